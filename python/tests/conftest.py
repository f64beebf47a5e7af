"""Tests under an emulator of another processor (tests/aarch64.sh)."""

import errno
import os
from collections.abc import Generator

import pytest


@pytest.hookimpl(wrapper=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> Generator[None, object, object]:
    """Skips a test that starts another program, or needs a package that is not installed there.

    An emulator runs only the program that it was given.
    """
    try:
        return (yield)
    except ModuleNotFoundError as error:
        if "MARATHON_TEST_EMULATED" in os.environ:
            pytest.skip(f"no package {error.name} here")
        raise
    except OSError as error:
        if error.errno == errno.ENOEXEC and "MARATHON_TEST_EMULATED" in os.environ:
            pytest.skip("the emulator cannot start other programs")
        raise
