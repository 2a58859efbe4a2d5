"""Runs: a task with its folder, one piece of work per call."""
from ctypes import byref, sizeof
from dataclasses import dataclass, field, fields
from typing import Any, Dict, Iterator, List, Optional

import numpy as np

from . import _native
from ._arrays import ByValue, Floats
from ._dlpack import Memory
from ._errors import check
from ._handle import Handle
from ._library import lib
from ._records import RunEvent
from ._text import json_from

ENDS = (_native.RunEventKind.DONE, _native.RunEventKind.INTERRUPTED,
        _native.RunEventKind.NOT_FINITE, _native.RunEventKind.NOTHING_DRAWN)


@dataclass(frozen=True, eq=False)
class Event(ByValue, RunEvent):
    """What one piece of a run did; `kind` says which fields have values.

    numbers        by their names in metrics.jsonl, such as "loss", "psnr" and "val_psnr"
    drawn, truths  of a validated piece, float32 [views,3,height,width]
    """

    numbers: Dict[str, float] = field(default_factory=dict)
    drawn: Optional[Floats] = None
    truths: Optional[Floats] = None

    @property
    def ends(self) -> bool:
        """True if the run is over."""
        return self.kind in ENDS


def _copy(pointer: Optional[int], event: Any) -> Optional[Floats]:
    """A copy of the images of an event."""
    if not pointer or event.image_count == 0:
        return None
    shape = (event.views, 3, event.height, event.width)
    return np.array(np.asarray(Memory(pointer, shape, np.dtype(np.float32), True)))


def _event(raw: Any) -> Event:
    """A copy of an event."""
    facts = RunEvent.of(raw)
    numbers = raw.numbers[:raw.number_count] if raw.number_count else ()
    return Event(**{each.name: getattr(facts, each.name) for each in fields(facts)},
                 numbers={each.name.decode(): each.value for each in numbers},
                 drawn=_copy(raw.images, raw), truths=_copy(raw.truths, raw))


class Run(Handle):
    """A task with its folder: an iterator of events. `Training` and `Fit` open one.

    A run that ends anywhere and is resumed has the same bits as one without an interruption.
    """

    __slots__ = ("_ended",)
    _kind = "run"
    _ended: bool

    def _begin(self) -> None:
        self._ended = False

    def next(self) -> Event:
        """Do the next piece of work: a step, one piece of a validation, a saved state.

        After the end it gives the last event again, without text. After an error or Ctrl-C the next
        call tries the same piece.
        """
        raw = _native.splat_run_event(struct_size=sizeof(_native.splat_run_event))
        events: List[Event] = []

        def call() -> int:  # with the lock: what `raw` points to is lent until the next call
            with self._lent() as kept:
                code: int = lib.splat_run_next(kept.handle, byref(raw))
                if code >= 0:
                    events.append(_event(raw))
                return code

        self._run(call)
        self._ended = events[0].ends
        return events[0]

    def __iter__(self) -> Iterator[Event]:
        return self

    def __next__(self) -> Event:
        if self._ended:
            raise StopIteration
        return self.next()

    def interrupt(self) -> None:
        """Let the next event save the state and end the run. Any thread may call it."""
        check(lib.splat_run_interrupt(self.handle))

    @property
    def report(self) -> Dict[str, Any]:
        """Step, loss, scores and memory so far."""
        found: Dict[str, Any] = json_from(lib.splat_run_report, self.handle)
        return found
