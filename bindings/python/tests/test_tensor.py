"""Devices and tensors."""
import contextlib
import gc
from typing import Any, Callable, Tuple
from unittest import mock

import numpy as np

import libsplat as splat
from libsplat import _dlpack
from shared import Case, run_program, values


class Pack:
    """Only DLPack, of memory somewhere."""

    def __init__(self, array: Any, device: int = 1) -> None:
        self.array, self.device = array, device

    def __dlpack__(self, **_: Any) -> Any:
        return self.array.__dlpack__()

    def __dlpack_device__(self) -> Any:
        return (self.device, 0)


def far_away(tensor: int) -> int:
    """What `_dlpack.export` does for devices with a memory of their own."""
    raise splat.Unsupported("far away")


class Devices(Case):
    """Enumeration, selection, memory, profiles."""

    def test_devices_are_described(self) -> None:
        found = splat.devices()
        self.assertGreaterEqual(len(found), 1)
        info = self.device.info
        self.assertEqual(info.name, found[info.index].name)
        self.assertEqual(splat.Device(info.index).info.uuid, info.uuid)
        self.assertEqual(splat.Device(uuid=info.uuid).info.index, info.index)
        self.assertEqual(splat.Device(kind=info.kind).info.kind, info.kind)

    def test_memory_is_counted_and_bounded(self) -> None:
        with splat.Device(max_bytes=64 << 20) as device:
            tensor = splat.Tensor.zeros(device, (1 << 20,))
            self.assertGreaterEqual(device.memory.live_bytes, 4 << 20)
            tensor.close()
            self.assertEqual(device.memory.live_bytes, 0)
            self.refused(splat.OutOfDeviceMemory, "budget", splat.Tensor.zeros, device, (1 << 25,))

    def test_profiles(self) -> None:
        with splat.Device(profile=True, kernels="plain", max_submit=0.05) as device:
            splat.Tensor(device, values(5)).check()
            self.assertGreater(device.profile()["lists"]["longest_submit_ms"], 0)
            self.assertTrue(device.profile()["ops"])
            self.assertIn("ms", device.profile_table())
            device.reset_profile()
            self.assertEqual(device.profile()["ops"], [])
            self.assertEqual(device.info.kernels, splat.Kernels.PLAIN)
        self.refused(splat.InvalidState, "profile=True", self.device.profile)

    def test_bad_arguments(self) -> None:
        self.refused(splat.InvalidArgument, "exclude each other", splat.Device, 0, kind="cpu")
        self.refused(splat.InvalidArgument, "kernels is 'fast'", splat.Device, kernels="fast")
        self.refused(splat.InvalidArgument, "index is -1", splat.Device, -1)
        self.refused(splat.InvalidArgument, "uuid has 3 bytes", splat.Device, uuid=b"abc")
        self.refused(splat.InvalidArgument, "timeout", splat.Device, timeout=-1)
        self.refused(splat.InvalidArgument, "max_submit", splat.Device, max_submit=-1)
        self.refused(splat.NoDevice, "llvmpipe" if "llvmpipe" in repr(self.device) else "",
                     splat.Device, kind="other")


class Tensors(Case):
    """Arrays in and out."""

    def test_arrays_of_each_type_come_back(self) -> None:
        for dtype in (np.float32, np.int32, np.uint32):
            array = np.arange(24).reshape(2, 3, 4).astype(dtype)
            tensor = splat.Tensor(self.device, array, name="a")
            self.assertEqual((tensor.shape, tensor.dtype, tensor.info.name),
                             ((2, 3, 4), np.dtype(dtype), "a"))
            np.testing.assert_array_equal(tensor.numpy(), array)

    def test_any_layout(self) -> None:
        base = values(6, 8)
        for array in (base[::2, 1::3], base.T, base[::-1], np.broadcast_to(base[0], (4, 8)),
                      base[:, ::-2], np.asfortranarray(base), np.float32(3)):
            np.testing.assert_array_equal(splat.Tensor(self.device, array).numpy(), array)
        out = np.zeros((8, 12), np.float32)
        splat.Tensor(self.device, base).numpy(out[:6, :8].T.T)
        np.testing.assert_array_equal(out[:6, :8], base)
        tensor = splat.Tensor.zeros(self.device, (6, 8))
        tensor.write(base[::-1])
        np.testing.assert_array_equal(tensor, base[::-1])

    def test_sequences_buffers_and_interfaces(self) -> None:
        import array
        given: Tuple[Any, ...] = ([[1, 2], [3, 4]], array.array("f", [1, 2, 3]), memoryview(values(3)),
                                  5, Pack(values(2, 2)))
        for data in given:
            self.assertEqual(splat.Tensor(self.device, data).dtype, np.float32)

    def test_array_shares_memory(self) -> None:
        tensor = splat.Tensor(self.device, values(3, 4))
        array = tensor.array
        array[1, 2] = 7
        self.assertEqual(tensor.numpy()[1, 2], 7)
        tensor.write(np.ones((3, 4), np.float32))
        self.assertEqual(array.sum(), 12)
        tensor.close()
        gc.collect()
        self.assertEqual(array[1, 2], 1)  # the memory outlives the tensor
        self.assertEqual(splat.Tensor(self.device, 2).array.shape, ())

    def test_map(self) -> None:
        tensor = splat.Tensor(self.device, values(3))
        with tensor.map() as array:
            array[:] = [1, 2, 3]
            self.refused(splat.InvalidState, "mapped", tensor.numpy)
        np.testing.assert_array_equal(tensor, [1, 2, 3])
        with tensor.map("read") as array:
            self.assertFalse(array.flags.writeable)

    def test_the_array_of_map_ends_with_the_block(self) -> None:
        tensor = splat.Tensor(self.device, values(3))
        with tensor.map() as array:
            array[:] = [1, 2, 3]
        ended: Any = array
        self.assertIn("has ended", repr(ended))
        uses: Tuple[Callable[[], object], ...] = (
            lambda: ended[0], lambda: ended + 1, lambda: ended.sum(), lambda: float(ended),
            lambda: ended.__setitem__(..., 0))
        for use in uses:
            with self.assertRaises((TypeError, IndexError, ValueError)):
                use()
        self.refused(splat.InvalidArgument, "has ended", splat.Tensor, self.device, array)
        with self.assertRaisesRegex(ZeroDivisionError, "in the block"):
            with tensor.map() as array:
                part = array[1:]
                raise ZeroDivisionError("in the block")
        np.testing.assert_array_equal(tensor, [1, 2, 3])
        self.assertEqual(part.sum(), 5)

    def test_an_array_that_is_kept_keeps_the_mapping(self) -> None:
        keep: Tuple[Callable[[Any], Any], ...] = (
            lambda array: array[1:], lambda array: array, lambda array: array.reshape(1, 3).T,
            memoryview, lambda array: [array], lambda array: array.view(np.matrix), iter)
        for shared in (True, False):
            for kept_of in keep:
                self.kept_mapping(kept_of, shared)

    def kept_mapping(self, kept_of: Callable[[Any], Any], shared: bool) -> None:
        """Leave a block with something that refers to its memory; not shared: of another device."""
        tensor = splat.Tensor(self.device, values(3))
        away = mock.patch.object(_dlpack, "export", far_away)
        around: Any = contextlib.nullcontext() if shared else away
        with around:
            with self.assertRaisesRegex(BufferError, "still refers to the memory"):
                with tensor.map() as array:
                    kept = kept_of(array)
        array[:] = [4, 5, 6]
        self.refused(splat.InvalidState, "mapped", tensor.numpy)
        del array
        self.refused(splat.InvalidState, "mapped", tensor.numpy)
        del kept
        np.testing.assert_array_equal(tensor, [4, 5, 6])

    def test_map_where_memory_is_not_shared(self) -> None:
        tensor = splat.Tensor(self.device, values(3))
        with mock.patch.object(_dlpack, "export", far_away):
            with tensor.map() as array:
                np.testing.assert_array_equal(array, values(3))
                array[:] = [1, 2, 3]
            with tensor.map("read") as array:
                self.assertEqual((array.tolist(), array.flags.writeable), ([1, 2, 3], False))
            with tensor.map("write") as array:
                array[:] = 5
        np.testing.assert_array_equal(tensor, [5, 5, 5])

    def test_only_a_memoryview_costs_a_walk_over_all_objects(self) -> None:
        tensor = splat.Tensor(self.device, values(3))
        holder: Any = [None]
        with mock.patch("libsplat.tensor.FREES_FORMATS", True), \
                mock.patch("gc.get_referrers", wraps=gc.get_referrers) as walk:
            with tensor.map() as array:
                array[:] = 1
            walk.assert_not_called()
            with tensor.map() as holder[0]:
                holder[0] = memoryview(holder[0])
            walk.assert_called_once()
        self.assertEqual(holder[0][2], 1)

    def test_a_mapped_tensor_may_be_closed(self) -> None:
        with splat.Device() as device:
            tensor = splat.Tensor(device, values(3))
            with self.assertRaises(BufferError):
                with tensor.map() as array:
                    kept = array[1:]
                    tensor.close()
            del array
            self.assertEqual(kept.tolist(), values(3)[1:].tolist())
            self.assertGreater(device.memory.live_bytes, 0)
            del kept
            self.assertEqual(device.memory.live_bytes, 0)

    def test_arrays_that_outlive_their_block_and_tensor(self) -> None:
        self.assertEqual(run_program("""
import numpy as np, libsplat as splat
device = splat.Device()
views = []
for number in range(200):
    tensor = splat.Tensor(device, np.full(1 << 16, number, np.float32))
    holder = [None]
    with tensor.map() as holder[0]:
        holder[0] = memoryview(holder[0])
    views.append(holder[0])
    tensor.close()
print(sum(view[1000] for view in views))
device.close()
del views[100:], tensor, device, holder
print(sum(view[1000] for view in views))
"""), (0, "19900.0\n4950.0\n", ""))

    def test_numpy_asks_for_no_copy(self) -> None:
        tensor = splat.Tensor(self.device, values(3))
        array = tensor.__array__(np.float32, copy=False)
        array[0] = 7
        self.assertEqual(tensor.numpy()[0], 7)
        self.refused(ValueError, "without a copy", tensor.__array__, np.float64, copy=False)
        self.assertEqual(tensor.__array__(np.float64).dtype, np.float64)
        tensor.__array__(copy=True)[0] = 8
        tensor.__array__()[0] = 8
        self.assertEqual(tensor.numpy()[0], 7)
        with mock.patch.object(_dlpack, "export", far_away):
            self.refused(ValueError, "far away", tensor.__array__, copy=False)
        if np.lib.NumpyVersion(np.__version__) >= "2.0.0":
            asarray: Any = np.asarray
            self.assertIs(asarray(tensor, copy=False).dtype, np.dtype(np.float32))
            self.refused(ValueError, "without a copy", asarray, tensor, np.float64, copy=False)

    def test_stats(self) -> None:
        stats = splat.Tensor(self.device, [1, float("nan"), float("inf"), 3]).check()
        self.assertEqual((stats.nan_count, stats.inf_count, stats.min, stats.max, stats.mean),
                         (1, 1, 1, 3, 2))

    def test_bad_input(self) -> None:
        make, device = splat.Tensor, self.device
        self.refused(splat.InvalidArgument, "dtype is float64", make, device, values(3) * 1.0e0 +
                     np.zeros(3))
        self.refused(splat.InvalidArgument, "dtype is >f4", make, device,
                     values(3).astype(">f4"))
        self.refused(splat.InvalidArgument, "expected float32", make, device, np.array(["a"]))
        self.refused(splat.InvalidArgument, "expected numbers", make, device, ["a"])
        self.refused(splat.InvalidArgument, "cannot be read as an array", make, device,
                     Pack(np.zeros(2, ">f4")))
        self.refused(splat.InvalidArgument, "memory of a device of DLPack's type 2", make, device,
                     Pack(values(2), 2))
        self.refused(splat.InvalidArgument, "at least one element", make, device, values(0, 3))
        self.refused(splat.InvalidArgument, "9 dimensions", make, device, np.zeros((1,) * 9,
                                                                                   np.float32))
        self.refused(splat.InvalidArgument, "dims", make.zeros, device, (2, -1))
        self.refused(splat.InvalidArgument, "dtype is 'none'", make.zeros, device, 3, "none")
        for shape in ((2.7, 3), (3, np.float32(2)), "23", 2.7, (None,), (np.ones(2, int),)):
            self.refused(splat.InvalidArgument, "expected whole numbers", make.zeros, device, shape)
        shapes: Tuple[Any, ...] = (np.int64(3), np.array([2, 3]), range(1, 3))
        self.assertEqual([make.zeros(device, each).shape for each in shapes],
                         [(3,), (2, 3), (1, 2)])
        self.refused(splat.InvalidArgument, "beyond 64 bits", make.zeros, device, ((1 << 64) + 2,))
        tensor = make(device, values(3, 4))
        self.refused(splat.ShapeMismatch, "expected [3,4]", tensor.write, values(4, 3))
        self.refused(splat.InvalidArgument, "expected float32", tensor.write,
                     np.zeros((3, 4), np.int32))
        self.refused(splat.ShapeMismatch, "expected [3,4]", tensor.numpy, values(3))
        self.refused(splat.InvalidArgument, "can be written", tensor.numpy, [1])
        frozen = values(3, 4)
        frozen.flags.writeable = False
        self.refused(splat.InvalidArgument, "can be written", tensor.numpy, frozen)
        self.refused(splat.InvalidArgument, "negative", tensor.numpy, values(3, 4)[::-1])
        self.refused(splat.InvalidArgument, "name has a NUL", make.zeros, device, 1, name="a\0b")

    def test_like_an_array(self) -> None:
        array = values(3, 4)
        tensor = splat.Tensor(self.device, array)
        self.assertEqual((tensor.ndim, tensor.size, len(tensor)), (2, 12, 3))
        np.testing.assert_array_equal(tensor[1:, ::2], array[1:, ::2])
        np.testing.assert_array_equal(list(tensor), array)
        self.assertEqual(tensor[2, 3], array[2, 3])
        self.refused(ValueError, "read-only", tensor[0].__setitem__, 0, 1)
        self.assertEqual(float(splat.Tensor(self.device, [[2.5]])), 2.5)
        self.refused(TypeError, "shape [3,4] is no number", float, tensor)
        self.assertEqual(splat.Tensor(self.device, 5.0)[()], 5)

    def test_masked_arrays_are_refused(self) -> None:
        numpy_ma: Any = np.ma
        masked = numpy_ma.masked_greater(values(4, 3), 0.5)
        words = "is a masked array"
        for data in (masked, [masked, masked], [[1, numpy_ma.masked]], masked[0, 0:1]):
            self.refused(splat.InvalidArgument, words, splat.Tensor, self.device, data)
        tensor = splat.Tensor(self.device, values(4, 3))
        self.refused(splat.InvalidArgument, words, tensor.write, masked)
        self.refused(splat.InvalidArgument, words, tensor.numpy, masked)
        self.refused(splat.InvalidArgument, words, splat.Scene, masked)
        self.refused(splat.InvalidArgument, words, splat.Image, masked)
        self.refused(splat.InvalidArgument, words, splat.Weights, {"a": masked})
        self.refused(splat.InvalidArgument, words, splat.Camera, 4, 4, 5,
                     world_to_camera=numpy_ma.masked_equal(np.eye(4), 0))
        self.refused(splat.InvalidArgument, words, splat.Camera.load,
                     (numpy_ma.masked_equal(np.zeros(9, np.uint8), 1), b""))
        self.refused(splat.InvalidArgument, "expected numbers", splat.Camera.look_at, (0, 0, 1),
                     np.array([1j, 0, 0]))
        splat.Tensor(self.device, masked.filled(0))

    def test_closed(self) -> None:
        tensor = splat.Tensor(self.device, 1)
        tensor.close()
        tensor.close()
        self.refused(splat.InvalidHandle, "this Tensor was closed", tensor.numpy)
        self.refused(splat.InvalidHandle, "this Tensor was closed", getattr, tensor, "array")
        device = splat.Device()
        device.close()
        self.refused(splat.InvalidHandle, "this Device was closed", splat.Tensor, device, 1)


class Dlpack(Case):
    """Memory shared with other libraries."""

    def test_numpy_takes_it_without_a_copy(self) -> None:
        tensor = splat.Tensor(self.device, values(3, 4))
        shared = np.from_dlpack(tensor)
        np.testing.assert_array_equal(shared, tensor)
        tensor.write(np.ones((3, 4), np.float32))
        self.assertEqual(shared.sum(), 12)
        tensor.close()
        self.assertEqual(shared.sum(), 12)
        self.assertEqual(tensor.__dlpack_device__(), (1, 0))

    def test_memory_is_freed_with_the_last_user(self) -> None:
        with splat.Device() as device:
            for versioned in (None, (1, 0)):
                tensor = splat.Tensor(device, values(1000))
                capsule = tensor.__dlpack__(max_version=versioned)
                self.assertIn("dltensor_versioned" if versioned else '"dltensor"', repr(capsule))
                tensor.close()
                self.assertGreater(device.memory.live_bytes, 0)
                del capsule  # no one took it
                self.assertEqual(device.memory.live_bytes, 0)
            tensor = splat.Tensor(device, values(1000))
            shared = np.from_dlpack(tensor)
            view = tensor.array
            tensor.close()
            del shared
            self.assertGreater(device.memory.live_bytes, 0)
            del view
            self.assertEqual(device.memory.live_bytes, 0)

    def test_what_cannot_be_given(self) -> None:
        tensor = splat.Tensor(self.device, values(3))
        self.refused(BufferError, "a copy", tensor.__dlpack__, copy=True)
        self.refused(BufferError, "only (1, 0)", tensor.__dlpack__, dl_device=(2, 0))

    def test_arrays_that_outlive_the_interpreter(self) -> None:
        status, output, errors = run_program("""
import numpy as np, libsplat as splat, sys
tensor = splat.Tensor(splat.Device(), np.ones(9, np.float32))
sys.keep = [np.from_dlpack(tensor), tensor.array, tensor.__dlpack__(), tensor]
class Late:
    keep = np.from_dlpack(tensor)
    def __del__(self): print(float(self.keep[0]))
import builtins
builtins.late = Late()
""")
        self.assertEqual((status, output, errors), (0, "1.0\n", ""))
