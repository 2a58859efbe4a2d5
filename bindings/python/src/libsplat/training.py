"""Training: a run with its folder, of one process or several, and the trainer and batches that it is made of."""
import threading
from ctypes import (CFUNCTYPE, addressof, byref, c_float, c_int32, c_size_t, c_uint8, c_void_p, cast,
                    create_string_buffer, pointer, sizeof)
from typing import Any, Callable, Dict, List, Optional, Sequence, Union

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._arrays import ArrayLike, File, Floats, address, file_of, set_arrays
from ._dlpack import Memory
from ._errors import Error, check, direct
from ._handle import Handle, made
from ._library import lib
from ._records import TrainerInfo
from ._text import PathLike, bytes_from, flags_of, json_from, json_of, path_of
from .camera import Camera, camera_array
from .dataset import Config, Dataset, texts
from .device import Device, default_device, whole
from .model import Model
from .run import Event, Run
from .weights import Weights

Bytes = NDArray[np.uint8]
_Describe = CFUNCTYPE(c_void_p, c_void_p, c_int32)  # ctypes would leak a text that the function returns


class Ranks:
    """The ranks of a training, and what this one reaches the others by: a class of yours, with these methods.

        class Gloo(splat.Ranks):
            def send_receive(self, peer, sent, received): ...
            def broadcast(self, root, data): ...
            def barrier(self): ...

        splat.Training("run", config, ranks=Gloo(rank, count))

    All ranks make the same calls in the same order, on a thread of the library's choice. What a method raises ends the
    training and is raised by the call of it that runs; other ranks get it as a sentence, or wait until their own
    method gives up: it needs a time limit. Ctrl-C waits for a method that runs.
    """

    __slots__ = ("count", "rank")

    def __init__(self, rank: int, count: int) -> None:
        """rank  0 ... count - 1; 0 has the folder of the run. count  a power of two, at most 4096"""
        self.rank, self.count = whole(rank, "rank"), whole(count, "count")

    def send_receive(self, peer: int, sent: Bytes, received: Bytes) -> None:
        """Send bytes to rank `peer` and receive as many from it, which makes the same call; `sent` must not change."""
        raise NotImplementedError(f"{type(self).__name__} has no send_receive")

    def broadcast(self, root: int, data: Bytes) -> None:
        """Give the bytes of rank `root` to all."""
        raise NotImplementedError(f"{type(self).__name__} has no broadcast")

    def barrier(self) -> None:
        """Return when all ranks have called it."""
        raise NotImplementedError(f"{type(self).__name__} has no barrier")

    def sum(self, values: Floats) -> None:
        """Replace float32 numbers by their sums over all ranks, in any order: then runs cannot be reproduced.

        A class without this method has gradients summed in a fixed order: 1, 2, 4... ranks have the same bits.
        """
        raise NotImplementedError(f"{type(self).__name__} has no sum")


def _array(kind: Any, at: int, count: int) -> Any:
    """Memory of the library as an array, without a copy."""
    dtype = np.dtype(kind)
    return np.frombuffer(memoryview((kind * count).from_address(at)), dtype) if count > 0 else np.empty(0, dtype)


def _bytes(at: int, count: int) -> Bytes:
    found: Bytes = _array(c_uint8, at, count)
    return found


class _Calls:
    """A Ranks as functions of C, and what they raised first. It must live until the run is destroyed."""

    def __init__(self, ranks: Ranks) -> None:
        self.raised: Optional[BaseException] = None
        self._text = create_string_buffer(b"", 1000)
        self.raw = _native.splat_group(struct_size=sizeof(_native.splat_group), rank=ranks.rank, count=ranks.count)

        def send_receive(user: Any, peer: int, sent: int, received: int, count: int) -> int:
            return self._done(lambda: ranks.send_receive(peer, _bytes(sent, count), _bytes(received, count)))

        def broadcast(user: Any, root: int, data: int, count: int) -> int:
            return self._done(lambda: ranks.broadcast(root, _bytes(data, count)))

        def sum_up(user: Any, values: Any, count: int) -> int:
            numbers = _array(c_float, addressof(values.contents), count)
            return self._done(lambda: ranks.sum(numbers))

        self.raw.send_receive = _native.splat_group_send_receive(send_receive)
        self.raw.broadcast = _native.splat_group_broadcast(broadcast)
        self.raw.barrier = _native.splat_group_barrier(lambda user: self._done(ranks.barrier))
        if type(ranks).sum is not Ranks.sum:
            self.raw.sum = _native.splat_group_sum(sum_up)
        self._describe = _Describe(lambda user, number: addressof(self._text))
        self.raw.describe = cast(self._describe, _native.splat_group_describe)

    def _done(self, call: Callable[[], None]) -> int:
        """0, or 1 after an exception."""
        try:
            call()
        except BaseException as error:
            if self.raised is None:
                self.raised = error.with_traceback(None)  # whose frames have memory of the library
            text = f"{type(error).__name__}: {error}".encode("utf-8", "replace")[:999].decode("utf-8", "ignore")
            self._text.value = text.encode()
            return 1
        return 0


class Training(Run):
    """A training as a run: an iterator of events.

        for event in splat.Training("run", config, values=["data.root=cars"]):
            print(event.text, event.numbers.get("loss"))

    Numbers of its events, such as "psnr" and "val_psnr", are those of metrics.jsonl. A run that ends
    anywhere and is resumed has the same bits as one without an interruption.

    folder      receives configuration, log, metrics, states and weights
    config      text (JSON or YAML) or a dict; None: the defaults, or the run's when resuming
    values      changes to it, "key=value"
    dataset     None: the split train of data.root; validation: None with it: val of data.root
    init        file of weights to start from; None: opt.pretrained_ckpt, else random
    resume      go on from the latest state; overwrite: replace the run in the folder
    ranks       the ranks that train together, each on a device of its own: all make this object with equal data,
                configuration and `init`, and take its events; None: there are no others
    Raises InvalidArgument, InvalidState (the folder is in use, or holds something else), NotFound,
    FormatError, IoError; the folder is then untouched. Raises what a method of `ranks` does.
    """

    __slots__ = ("_calls",)

    def __init__(self, folder: PathLike, config: Config = None, *, values: Sequence[str] = (),
                 device: Optional[Device] = None, dataset: Optional[Dataset] = None,
                 validation: Optional[Dataset] = None, init: Optional[PathLike] = None,
                 init_flags: int = 0, resume: bool = False, overwrite: bool = False,
                 ranks: Optional[Ranks] = None) -> None:
        device = default_device() if device is None else device
        self._calls = None if ranks is None else _Calls(ranks)
        bits = _native.TrainingFlags
        desc = _native.splat_training_desc(struct_size=sizeof(_native.splat_training_desc))
        desc.flags = flags_of((resume, bits.RESUME), (overwrite, bits.OVERWRITE))
        desc.folder, desc.config = path_of(folder, "folder"), json_of(config, "config")
        desc.values, desc.value_count = texts(values, "a value"), len(values)
        desc.dataset = None if dataset is None else dataset.handle
        desc.validation = None if validation is None else validation.handle
        desc.init, desc.init_flags = path_of(init, "init"), whole(init_flags, "init_flags")
        if self._calls is not None:
            desc.group = pointer(self._calls.raw)
        try:
            opened = made("run", direct, lib.splat_training_open, device.handle, byref(desc))
        except Error as error:
            raise self._raised(error) from None
        self._own(opened, device, self._calls)
        self._lock = threading.RLock()
        self._begin()

    def _raised(self, error: Error) -> BaseException:
        """What a method of `ranks` raised, if it did, else the error."""
        raised = None if self._calls is None else self._calls.raised
        return error if raised is None else raised

    def next(self) -> Event:
        """Do as `Run.next`. Raises what a method of `ranks` does."""
        try:
            return super().next()
        except Error as error:
            raise self._raised(error) from None

    @property
    def last_step(self) -> TrainerInfo:
        """Facts of the latest step of this session, skipped or not."""
        info = _native.splat_trainer_info(struct_size=sizeof(_native.splat_trainer_info))
        check(lib.splat_training_last_step(self.handle, byref(info)))
        return TrainerInfo.of(info)

    def model(self) -> Model:
        """The network in training."""
        return Model._of(made("model", self._call, lib.splat_training_model, self.handle),
                         self._device)


class Batch:
    """One update's images and cameras: B objects with V input and T target images each.

    images [B*V,channels,R,R], view_to_world [B*V,4,4] row vectors, quaternions [B*V,4], focals
    [B*V,2] where data.fov is 0, embedding, tokens, planes [B*V,5,R,R] where opt.lambda_plane is
    above 0; targets [B*T,3,R,R] and their `cameras`
    """

    __slots__ = ("raw", "__weakref__")

    def __init__(self, images: ArrayLike, targets: ArrayLike, cameras: Sequence[Camera], *,
                 view_to_world: ArrayLike, quaternions: ArrayLike,
                 focals: Optional[ArrayLike] = None, embedding: Optional[ArrayLike] = None,
                 tokens: Optional[ArrayLike] = None, planes: Optional[ArrayLike] = None) -> None:
        self.raw = _native.splat_trainer_batch(struct_size=sizeof(_native.splat_trainer_batch))
        kept = set_arrays(
            self.raw, images=images, view_to_world=view_to_world, quaternions=quaternions,
            focals=focals, embedding=embedding, tokens=tokens, planes=planes, targets=targets)
        if kept[0].ndim == 4:
            self.raw.channels = kept[0].shape[1]
        self.raw.cameras = camera_array(cameras)
        self.raw.cameras_count = len(cameras)


    def _copy(self) -> None:
        """Take copies of the library's arrays."""
        raw, kept = self.raw, []
        for name in ("images", "view_to_world", "quaternions", "focals", "embedding", "tokens",
                     "planes", "targets"):
            pointer, count = getattr(raw, name), getattr(raw, f"{name}_count")
            if pointer and count:
                kept.append(np.array(Memory(pointer, (count,), np.dtype(np.float32), True)))
                setattr(raw, name, address(kept[-1]))
        raw.kept = kept
        raw.cameras = (_native.splat_camera * raw.cameras_count)(*raw.cameras[:raw.cameras_count])


class Batches(Handle):
    """The batches of a training, read ahead. Batch n depends on the seed and n alone.

    dataset  opened at data.training_resolution, with the maps and background of the configuration
    config   that of the trainer
    """

    __slots__ = ()
    _kind = "batches"

    def __init__(self, dataset: Dataset, config: Config = None, seed: int = 0) -> None:
        self._own(made("batches", direct, lib.splat_batches_create, dataset.handle,
                       json_of(config, "config"), whole(seed, "seed", 64)))
        self._lock = threading.RLock()

    def next(self, step: int) -> Batch:
        """Batch number `step`, for `Trainer.step`; a copy."""
        batch = Batch.__new__(Batch)
        batch.raw = _native.splat_trainer_batch(struct_size=sizeof(_native.splat_trainer_batch))
        assert self._lock is not None
        with self._lent() as kept, self._lock:  # the library's arrays are lent until the next call
            check(lib.splat_batches_next(kept.handle, whole(step, "step", 64), byref(batch.raw)))
            batch._copy()
        return batch


class Trainer(Handle):
    """A network in training: parameters, Adam's moments, averaged weights, and a rasterizer.

    config  from `config_merge`; None: the defaults. Parameters are zero until the model has others.
    """

    __slots__ = ()
    _kind = "trainer"

    def __init__(self, device: Optional[Device] = None, config: Config = None) -> None:
        device = default_device() if device is None else device
        desc = _native.splat_trainer_desc(struct_size=sizeof(_native.splat_trainer_desc))
        desc.config = json_of(config, "config")
        self._own(made("trainer", direct, lib.splat_trainer_create, device.handle, byref(desc)),
                  device)
        self._lock = threading.RLock()

    def model(self) -> Model:
        """The network, to initialise, load, store and read it."""
        return Model._of(made("model", self._call, lib.splat_trainer_model, self.handle),
                         self._device)

    def step(self, batch: Batch) -> TrainerInfo:
        """Do one update; on an error there is none."""
        info = _native.splat_trainer_info(struct_size=sizeof(_native.splat_trainer_info))
        self._run(lib.splat_trainer_step, self.handle, byref(batch.raw), byref(info))
        return TrainerInfo.of(info)

    def step_unread(self, batch: Batch) -> None:
        """Do one update; what it did is not read from the device, until `read`."""
        self._run(lib.splat_trainer_step, self.handle, byref(batch.raw), None)

    def read(self) -> List[TrainerInfo]:
        """What the steps of `step_unread` did, oldest first, each once."""
        count = c_size_t()
        self._run(lib.splat_trainer_read, self.handle, None, 0, byref(count))
        infos = (_native.splat_trainer_info * count.value)()
        for info in infos:
            info.struct_size = sizeof(_native.splat_trainer_info)
        if infos:
            self._run(lib.splat_trainer_read, self.handle, infos, len(infos), None)
        return [TrainerInfo.of(info) for info in infos]

    @property
    def report(self) -> Dict[str, Any]:
        """Step, attempts, steps unread and skipped, counts of parameters, and the whole configuration."""
        found: Dict[str, Any] = json_from(lib.splat_trainer_report, self.handle)
        return found

    def store(self) -> Weights:
        """The averaged weights as a state dict, or the current ones if there are none."""
        return Weights._of(made("weights", self._run, lib.splat_trainer_store, self.handle))

    def save(self, path: PathLike) -> None:
        """Write all that the next step depends on to a .safetensors file, whole or not at all."""
        self._run(lib.splat_trainer_save, self.handle, path_of(path))

    def to_bytes(self) -> bytes:
        """The bytes of such a file."""
        return bytes_from(lib.splat_trainer_save_memory, self.handle, call=self._run)

    def resume(self, source: File) -> None:
        """Go on from such a file, its bytes, or an open file, bit-exactly. On an error nothing is changed."""
        data, path = file_of(source, "source")
        if data is not None:
            self._run(lib.splat_trainer_resume_memory, self.handle, address(data), data.size)
        else:
            self._run(lib.splat_trainer_resume, self.handle, path)
