"""The helper thread is lazy, ends when told to, and propagates what goes wrong."""

import os
import threading

import pytest

from grouser.envs.simulation.renderers.helper_thread import HelperThread


def test_the_thread_is_made_at_first_use_and_ends_at_close() -> None:
    before = threading.active_count()
    helper = HelperThread()
    assert threading.active_count() == before
    assert helper.submit(threading.get_ident).result() != threading.get_ident()
    assert threading.active_count() == before + 1
    helper.close()
    helper.close()
    assert threading.active_count() == before
    assert helper.submit(os.getpid).result() == os.getpid()  # and begins again
    helper.close()


def test_an_error_in_the_thread_reaches_the_caller() -> None:
    helper = HelperThread()

    def fail() -> None:
        raise RuntimeError("out of film")

    with pytest.raises(RuntimeError, match="out of film"):
        helper.submit(fail).result()
    helper.close()
