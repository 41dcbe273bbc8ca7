import json

from talk import Frame, Reply

from benchmarks.trial.promises import Promises, in_order


def frame(number: int, kind: str, **data: object) -> Frame:
    return Frame(number, kind, json.dumps(data))


def job(state: str = "succeeded", finished_at: str | None = "12:00") -> dict[str, object]:
    outcome = "optimal" if finished_at else None
    return {
        "id": "j",
        "state": state,
        "outcome": outcome,
        "finished_at": finished_at,
        "best": None,
        "plans": 1,
        "detail": "",
    }


def test_events_in_order_end_once_and_tell_of_each_revision() -> None:
    plan, end = frame(2, "plan", revision=1), frame(3, "end", outcome="optimal")
    state = frame(1, "state", state="queued")
    assert in_order([state, plan, end], job())
    assert not in_order([state, end, plan], job())
    assert not in_order([state, plan], job())
    assert not in_order([state, plan, end, frame(4, "end", outcome="optimal")], job())
    assert not in_order([state, frame(2, "plan", revision=2), end], job())
    assert not in_order([frame(2, "plan", revision=1), end], job())
    assert not in_order([state, plan, frame(3, "end", outcome="timeout")], job())


def test_a_job_that_ends_twice_is_noticed() -> None:
    promises = Promises()
    promises.acknowledge("key", Reply(202, "application/json", job("queued", None)))
    promises.see(job())
    promises.see(job())
    assert promises.ended_again == 0
    promises.see(job(finished_at="12:01"))
    assert promises.ended_again == 1


def test_a_key_that_makes_two_jobs_is_noticed() -> None:
    promises = Promises()
    promises.acknowledge("key", Reply(202, "application/json", job("queued", None)))
    promises.acknowledge("key", Reply(200, "application/json", job("queued", None)))
    assert promises.made_twice == 0
    promises.acknowledge("key", Reply(202, "application/json", {**job("queued", None), "id": "other"}))
    assert promises.made_twice == 1
    promises.acknowledge("key", Reply(500, "application/json", None))
    assert promises.odd.total() == 1
