from marsupial.model.robots import Role
from marsupial.wording import clock, counted, no_option, unknown, unknown_name


def test_times_are_shown_as_on_a_clock() -> None:
    times_s, shown = (0, 12.5, 59.6, 61, 3600, 3723.4), ["0:00", "0:13", "1:00", "1:01", "1:00:00", "1:02:03"]
    assert [clock(seconds) for seconds in times_s] == shown


def test_things_are_counted_in_their_number() -> None:
    assert [counted(number, "rover") for number in (0, 1, 2)] == ["0 rovers", "1 rover", "2 rovers"]


def test_a_name_that_is_nearly_right_is_suggested() -> None:
    assert unknown("planner", "gredy", ["auto", "greedy"]) == "unknown planner 'gredy', did you mean 'greedy'?"
    assert unknown_name("planner", "luck", ["auto", "greedy"]) == "unknown planner 'luck'; there are auto, greedy"
    assert no_option("carier", Role) == "must be carrier or rover, got 'carier', did you mean 'carrier'?"
    assert unknown("planner", "a" * 31, ["a" * 30]).endswith("'"), "long words take long to compare"
