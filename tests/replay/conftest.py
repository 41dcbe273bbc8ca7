import pytest
from played_pages import PlayedPage
from support.pictures.browser import Browser


@pytest.fixture
def browser(browser: Browser) -> PlayedPage:
    return PlayedPage(browser.driver)
