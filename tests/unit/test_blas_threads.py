"""Linear algebra on one thread, and on as many as before afterwards."""

import pytest
import scipy.linalg  # noqa: F401
import threadpoolctl

from dforce.core.blas_threads import one_blas_thread


def counts():
    return [library["num_threads"] for library in threadpoolctl.threadpool_info() if library["user_api"] == "blas"]


@pytest.fixture
def two_threads():
    """Give linear algebra two threads, whatever tests have."""
    with threadpoolctl.threadpool_limits(2, user_api="blas"):
        yield


@pytest.mark.skipif(not counts(), reason="no BLAS whose threads can be counted")
def test_threads_are_given_back_when_the_last_of_two_has_ended(two_threads):
    before = counts()
    assert before == [2] * len(before)
    first, second = one_blas_thread(), one_blas_thread()
    first.__enter__()
    second.__enter__()
    first.__exit__(None, None, None)
    assert counts() == [1] * len(before)
    second.__exit__(None, None, None)
    assert counts() == before
