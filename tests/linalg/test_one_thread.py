from threadpoolctl import threadpool_info, threadpool_limits

from o3d_relief.linalg.one_thread import one_thread


def threads() -> list[int]:
    return [library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"]


def test_limits_the_linear_algebra_to_one_thread_and_gives_the_others_back() -> None:
    with threadpool_limits(limits=2, user_api="blas"):
        before = threads()
        with one_thread():
            within = threads()
        after = threads()
    assert before
    assert set(within) == {1}
    assert after == before


def test_can_be_entered_again_and_again() -> None:
    for _ in range(3):
        with one_thread(), one_thread():
            assert set(threads()) == {1}
