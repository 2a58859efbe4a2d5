"""Tensors in memory that other processes and APIs open; CUDA's driver is a fake that tells what it was called with."""
import ctypes
import dataclasses
import gc
import os
import socket
import struct
import subprocess
import sys
from typing import Any, Callable, Dict, List, Tuple
from unittest import SkipTest, mock

import numpy as np

import libsplat as splat
from libsplat import _dlpack, _native
from shared import HERE, PYTHON, Case, values

CHILD = """
import sys, libsplat as splat
memory = splat.ExternalMemory(int(sys.argv[1]), int(sys.argv[2]), memory_type=int(sys.argv[3]))
tensor = splat.Tensor.from_memory(splat.default_device(), memory, (10, 100))
tensor.write(tensor.numpy() * 2)
"""
OWNER = """
import array, socket, sys, libsplat as splat
tensor = splat.Tensor.zeros(splat.default_device(), (10, 100), exportable=True)
tensor.write(tensor.numpy() + 3)
memory = tensor.export()
line = socket.socket(fileno=int(sys.argv[1]))
line.sendmsg([f"{memory.memory_bytes} {memory.memory_type}".encode()],
             [(socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", [memory.handle]))])
line.recv(1)
"""
CHILD_ENVIRONMENT = {**os.environ, "PYTHONPATH": os.pathsep.join([str(PYTHON / "src"), str(HERE)])}
ADDRESS = 0x7000
INT, POINTER = ctypes.c_int, ctypes.c_void_p
# By CUDA's documentation.
SIGNATURES: Dict[str, Tuple[Any, ...]] = {
    "cuInit": (ctypes.c_uint,), "cuDeviceGetCount": (POINTER,), "cuDeviceGet": (POINTER, INT),
    "cuDeviceGetUuid": (POINTER, INT), "cuDevicePrimaryCtxRetain": (POINTER, INT),
    "cuDevicePrimaryCtxRelease_v2": (INT,), "cuCtxPushCurrent_v2": (POINTER,), "cuCtxPopCurrent_v2": (POINTER,),
    "cuImportExternalMemory": (POINTER, POINTER),
    "cuExternalMemoryGetMappedBuffer": (POINTER, POINTER, POINTER), "cuMemFree_v2": (ctypes.c_uint64,),
    "cuDestroyExternalMemory": (POINTER,), "cuGetErrorName": (INT, POINTER)}


class FakeCuda:
    """The functions of CUDA's driver that are used, on devices with these UUIDs."""

    def __init__(self, *uuids: bytes, fails: str = "") -> None:
        self.uuids, self.fails = uuids, fails
        self.calls: List[str] = []
        self.handle = self.buffer = b""
        self.kept: List[Any] = []

    def __getattr__(self, name: str) -> Any:
        def called(*arguments: int) -> int:
            if name != "cuGetErrorName":
                self.calls.append(name)
            if name == self.fails:
                return 100
            getattr(FakeCuda, "_" + name, lambda *_: None)(self, *arguments)
            return 0
        function = ctypes.CFUNCTYPE(ctypes.c_int, *SIGNATURES[name])(called)
        self.kept.append(function)
        return function

    def _cuDeviceGetCount(self, count: int) -> None:
        ctypes.c_int.from_address(count).value = len(self.uuids)

    def _cuDeviceGet(self, device: int, index: int) -> None:
        ctypes.c_int.from_address(device).value = index

    def _cuDeviceGetUuid(self, uuid: int, device: int) -> None:
        ctypes.memmove(uuid, self.uuids[device], 16)

    def _cuDevicePrimaryCtxRetain(self, context: int, _: int) -> None:
        ctypes.c_void_p.from_address(context).value = 0x11

    def _cuImportExternalMemory(self, memory: int, desc: int) -> None:
        ctypes.c_void_p.from_address(memory).value = 0x22
        self.handle = ctypes.string_at(desc, 104)
        os.close(struct.unpack_from("i", self.handle, 8)[0])

    def _cuExternalMemoryGetMappedBuffer(self, pointer: int, memory: int, desc: int) -> None:
        assert memory == 0x22
        ctypes.c_uint64.from_address(pointer).value = ADDRESS
        self.buffer = ctypes.string_at(desc, 88)

    def _cuMemFree_v2(self, pointer: int) -> None:
        assert pointer == ADDRESS

    def _cuDestroyExternalMemory(self, memory: int) -> None:
        assert memory == 0x22

    def _cuGetErrorName(self, code: int, text: int) -> None:
        assert code == 100
        self.kept.append(ctypes.c_char_p(b"CUDA_ERROR_FAKE"))
        ctypes.c_void_p.from_address(text).value = ctypes.cast(self.kept[-1], ctypes.c_void_p).value


class External(Case):
    """Memory out of a tensor and into another."""

    tensor: splat.Tensor

    def setUp(self) -> None:
        super().setUp()
        if _native.FeatureFlags.EXTERNAL_MEMORY not in self.device.info.features:
            self.refused(splat.Unsupported, "copy the elements", splat.Tensor.zeros, self.device, 4, exportable=True)
            raise SkipTest("the device shares no memory")
        self.tensor = splat.Tensor.zeros(self.device, (10, 100), exportable=True)
        self.tensor.write(values(10, 100))
        self.files = len(os.listdir("/proc/self/fd"))

    def exported(self) -> splat.ExternalMemory:
        """The memory of the tensor, closed at the end of the test."""
        memory = self.tensor.export()
        self.addCleanup(os.close, memory.handle)
        return memory

    def test_another_process_writes(self) -> None:
        memory = self.exported()
        arguments = [str(each) for each in (memory.handle, memory.memory_bytes, memory.memory_type)]
        subprocess.run([sys.executable, "-c", CHILD, *arguments], pass_fds=[memory.handle], timeout=300, check=True,
                       env=CHILD_ENVIRONMENT)
        np.testing.assert_array_equal(self.tensor, values(10, 100) * 2)

    def test_memory_outlives_its_process(self) -> None:
        ours, theirs = socket.socketpair()
        self.addCleanup(ours.close)
        with theirs:
            owner = subprocess.Popen([sys.executable, "-c", OWNER, str(theirs.fileno())], pass_fds=[theirs.fileno()],
                                     env=CHILD_ENVIRONMENT)
        self.addCleanup(owner.wait)
        self.addCleanup(owner.kill)
        told, rights, _, _ = ours.recvmsg(100, socket.CMSG_SPACE(4))
        memory_bytes, memory_type = map(int, told.split())
        memory = splat.ExternalMemory(struct.unpack("i", rights[0][2])[0], memory_bytes, memory_type=memory_type)
        self.addCleanup(os.close, memory.handle)
        early = splat.Tensor.from_memory(self.device, memory, 1000)
        owner.kill()
        owner.wait()
        late = splat.Tensor.from_memory(self.device, memory, 1000)
        np.testing.assert_array_equal(early, np.full(1000, 3, np.float32))
        late.write(values(1000))
        np.testing.assert_array_equal(early, values(1000))

    def test_memory_outlives_its_owner(self) -> None:
        memory = self.tensor.export()
        self.tensor.close()
        imported = splat.Tensor.from_memory(splat.Device(), memory, 1000)
        os.close(memory.handle)
        np.testing.assert_array_equal(imported, values(1000))
        self.assertEqual(len(memory.device_uuid), 16)
        self.assertEqual(memory.device_uuid, self.device.info.uuid)
        self.refused(splat.InvalidState, "imported itself", imported.export)

    def test_refusals(self) -> None:
        memory = self.exported()

        def refused(words: str, **changed: Any) -> None:
            self.refused(splat.InvalidArgument, words, splat.Tensor.from_memory, self.device,
                         dataclasses.replace(memory, **changed), (10, 100))

        refused("no open file descriptor", handle=1 << 20)
        refused("handle is -1", handle=-1)
        refused("but the elements need", memory_bytes=3000)
        refused("expected a multiple", offset=4)
        refused("another device", device_uuid=bytes(15) + b"x")
        refused("expected 16 or none", driver_uuid=b"abc")
        plain = splat.Tensor(self.device, values(3))
        self.refused(splat.InvalidState, "not made to be exported", plain.export)
        self.refused(splat.InvalidState, "not made to be exported",
                     lambda: self.with_cuda(FakeCuda(self.device.info.uuid), plain.cuda))

    def with_cuda(self, fake: FakeCuda, call: Callable[[], Any]) -> Any:
        """Call with this driver."""
        with mock.patch.object(_dlpack, "find_driver", lambda: fake):
            return call()

    def test_without_cuda(self) -> None:
        with mock.patch.object(ctypes, "CDLL", side_effect=OSError("no such file")):
            self.refused(splat.Unsupported, "copy the elements with .numpy()", self.tensor.cuda)
        self.refused(splat.Unsupported, "none of CUDA's 1 devices",
                     lambda: self.with_cuda(FakeCuda(b"x" * 16), self.tensor.cuda))
        self.assertEqual(len(os.listdir("/proc/self/fd")), self.files)

    def test_failures_of_cuda_leave_nothing(self) -> None:
        uuid = self.device.info.uuid
        left: Dict[str, List[str]] = {
            "cuInit": [], "cuDevicePrimaryCtxRetain": [],
            "cuImportExternalMemory": ["cuCtxPopCurrent_v2", "cuDevicePrimaryCtxRelease_v2"],
            "cuExternalMemoryGetMappedBuffer": ["cuDestroyExternalMemory", "cuCtxPopCurrent_v2",
                                                "cuDevicePrimaryCtxRelease_v2"]}
        for name, after in left.items():
            fake = FakeCuda(uuid, fails=name)
            self.refused(splat.Unsupported, f"{name} failed with CUDA_ERROR_FAKE: copy",
                         lambda fake=fake: self.with_cuda(fake, self.tensor.cuda))
            self.assertEqual(fake.calls[fake.calls.index(name) + 1:], after)
            self.assertEqual(len(os.listdir("/proc/self/fd")), self.files)

    def test_cuda_maps_the_memory(self) -> None:
        fake = FakeCuda(b"x" * 16, self.device.info.uuid)
        array = self.with_cuda(fake, self.tensor.cuda)
        self.assertEqual(len(os.listdir("/proc/self/fd")), self.files)  # the driver has it
        with self.tensor.map("read"):
            pass
        memory = self.exported()
        kind, _, size, flags = struct.unpack_from("i4xi4x8xQI", fake.handle)
        self.assertEqual((kind, size, flags), (1, memory.memory_bytes, 0))
        self.assertEqual(struct.unpack_from("QQI", fake.buffer), (0, memory.memory_bytes, 0))
        self.assertEqual(array.__cuda_array_interface__, {
            "shape": (10, 100), "typestr": "<f4", "data": (ADDRESS, False), "strides": None, "stream": None,
            "version": 3})
        self.assertEqual(repr(array), "CudaArray([10, 100], float32, cuda:1)")
        self.tensor.close()
        del array
        gc.collect()
        self.assertEqual(fake.calls[-5:], ["cuCtxPushCurrent_v2", "cuMemFree_v2", "cuDestroyExternalMemory",
                                           "cuCtxPopCurrent_v2", "cuDevicePrimaryCtxRelease_v2"])

    def test_dlpack_on_cuda(self) -> None:
        fake = FakeCuda(self.device.info.uuid)
        array = self.with_cuda(fake, self.tensor.cuda)
        self.assertEqual(array.__dlpack_device__(), (2, 0))
        self.refused(BufferError, "only (2, 0)", array.__dlpack__, dl_device=(1, 0))
        self.refused(BufferError, "a copy", array.__dlpack__, copy=True)
        capsule = array.__dlpack__()
        held = next(each[0].dl_tensor for each in _dlpack._alive.values() if each[0].dl_tensor.data == ADDRESS)
        self.assertEqual((held.device_type, held.device_id, held.ndim, held.code, held.bits, held.lanes),
                         (2, 0, 2, 2, 32, 1))
        self.assertEqual((held.shape[:2], bool(held.strides), held.byte_offset), ([10, 100], False, 0))
        del array
        gc.collect()
        self.assertNotIn("cuMemFree_v2", fake.calls)  # the capsule keeps it
        del capsule, held
        gc.collect()
        self.assertIn("cuMemFree_v2", fake.calls)
