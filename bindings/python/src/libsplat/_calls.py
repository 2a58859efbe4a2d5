"""Calls that may take long, so that signals still reach the program.

Python runs signal handlers in the main thread, between two instructions of its own. A call of the
library is one instruction, however long it takes. So the main thread hands such a call to a worker
thread and waits for it, and a handler runs at once. If the handler raises, as Ctrl-C does, the call
is cancelled, the main thread waits for the end of the call, whose buffers it owns, and the exception
goes on. Other threads call directly. The way to the worker and back takes about 10 us.
"""
import _thread
import os
import threading
from contextlib import AbstractContextManager
from typing import Any, Callable, List, Optional

from ._errors import Error, last_error

# Seconds between two cancels of a call that does not end; the first may come before its start.
AGAIN = 0.02

Lock = AbstractContextManager  # a lock of threading


class _Thread:
    """What a worker thread and those who wait for it share."""

    def __init__(self) -> None:
        self.begin = _thread.allocate_lock()
        self.end = _thread.allocate_lock()
        self.begin.acquire()
        self.end.acquire()
        self.calls: List[Optional[Callable[[], int]]] = []  # the next one; None: end
        self.busy = False
        self.code = 0
        self.error: Optional[BaseException] = None

    def work(self) -> None:
        """Make one call after the other."""
        while True:
            self.begin.acquire()
            try:
                call = self.calls.pop()
            except IndexError:  # withdrawn
                continue
            if call is None:
                return
            try:
                self.code = call()
                if self.code < 0:  # the text belongs to this thread
                    self.error = last_error(self.code)
            except BaseException as error:  # to be raised where the call was made
                self.error = error
            call = None
            self.busy = False
            self.end.release()


class _Worker:
    """Owns a thread, which ends when the worker is lost, as by a signal at a bad moment."""

    thread: Optional[_Thread] = None

    def __init__(self) -> None:
        self.thread = _Thread()
        _thread.start_new_thread(self.thread.work, ())  # the interpreter does not wait for it

    def __del__(self) -> None:
        if self.thread is not None:
            self.thread.calls.append(None)
            if self.thread.begin.locked():
                self.thread.begin.release()


_idle: List[_Worker] = []
_direct = False  # no more workers


def _forget_workers() -> None:
    """In a forked child the threads of the parent do not exist."""
    _idle.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_workers)


def direct_only() -> None:
    """Make all calls directly from now on: at the end of the interpreter threads come to rest."""
    global _direct
    _direct = True


def _cancel(thread: _Thread, cancel: Optional[Callable[[], object]]) -> None:
    """Withdraw a call that has not begun, else cancel it and wait for its end.

    A second signal may end this early. The call then ends by itself: what it uses is kept by it.
    """
    try:
        thread.calls.pop()
    except IndexError:
        while thread.busy:
            if cancel is not None:
                cancel()
            thread.end.acquire(timeout=AGAIN)


def _locked(function: Callable[..., int], arguments: Any, lock: Optional["Lock[Any]"]) -> int:
    if lock is None:
        return function(*arguments)
    with lock:
        return function(*arguments)


def run(cancel: Optional[Callable[[], object]], lock: Optional["Lock[Any]"],
        function: Callable[..., int], *arguments: Any) -> int:
    """Call a function of the library that may take long.

    cancel     called, perhaps several times, when a signal handler raises; None: the call only ends
               by itself
    lock       held while the function runs; None: none
    Returns the result if it is no error. Raises Error, and what a signal handler raises.
    """
    if _direct or threading.current_thread() is not threading.main_thread():
        code = _locked(function, arguments, lock)
        if code < 0:
            raise last_error(code)
        return code
    worker = _idle.pop() if _idle else _Worker()
    thread = worker.thread
    assert thread is not None
    try:
        thread.error, thread.busy = None, True
        thread.calls.append(lambda: _locked(function, arguments, lock))
        thread.begin.release()
        thread.end.acquire()
    except BaseException:  # from a signal handler
        _cancel(thread, cancel)
        raise
    code, error = thread.code, thread.error
    _idle.append(worker)
    if error is None:
        return code
    thread.error = None
    try:
        raise error.with_traceback(None) if isinstance(error, Error) else error
    finally:
        del error  # the traceback keeps this frame, which must not keep it
