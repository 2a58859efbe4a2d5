#!/usr/bin/env python3
"""Makes compute pipelines on the first Vulkan device and prints what its compiler says of them; runs none.

    pipeline_statistics.py < PIPELINES

A line of PIPELINES is a SPIR-V file and its specialisation, "foo_gpu.spv 0=256 10=1". Standard output has one JSON
object a line: {device, driver} first, then {start} and {vulkan, statistics} for each, with the numbers of
VK_KHR_pipeline_executable_properties by the driver's names. What is missing after a {start} ended the process. Exit
status: 0 all were tried, 1 there is no device, or none that tells.
"""

import ctypes
import json
import struct
import sys
from ctypes import POINTER, Structure, byref, c_char, c_char_p, c_float, c_size_t, c_uint32, c_uint64, c_void_p

STATISTICS = b"VK_KHR_pipeline_executable_properties"
COMPUTE = 0x20  # VK_SHADER_STAGE_COMPUTE_BIT
STORAGE_BUFFER, TEXEL_BUFFER = 7, 4  # VkDescriptorType
CAPTURE_STATISTICS, DISPATCH_BASE = 0x40, 0x10  # VkPipelineCreateFlagBits, the second as libsplat has it
PUSH_BYTES = 128


class Head(Structure):
    """The first members of most structs."""
    _fields_ = [("type", c_uint32), ("next", c_void_p)]

    def __init__(self, *values, **named):
        super().__init__(**dict(zip((name for name, _ in self._fields_), values)), **named)
        self.type = self.TYPE


def described(type_number, fields):
    """A class of a Vulkan struct, whose VkStructureType and members after pNext are these."""
    return type("Described", (Head,), {"TYPE": type_number, "_fields_": fields})


Application = described(0, [("name", c_char_p), ("version", c_uint32), ("engine", c_char_p),
                            ("engine_version", c_uint32), ("api", c_uint32)])
Instance = described(1, [("flags", c_uint32), ("application", POINTER(Application)), ("layers", c_uint32),
                         ("layer_names", c_void_p), ("extensions", c_uint32), ("extension_names", c_void_p)])
Queue = described(2, [("flags", c_uint32), ("family", c_uint32), ("count", c_uint32), ("priorities", c_void_p)])
Device = described(3, [("flags", c_uint32), ("queues", c_uint32), ("queue", POINTER(Queue)), ("layers", c_uint32),
                       ("layer_names", c_void_p), ("extensions", c_uint32), ("extension_names", POINTER(c_char_p)),
                       ("features", c_void_p)])
Module = described(16, [("flags", c_uint32), ("bytes", c_size_t), ("code", c_char_p)])
Stage = described(18, [("flags", c_uint32), ("stage", c_uint32), ("module", c_uint64), ("entry", c_char_p),
                       ("specialisation", c_void_p)])
Pipeline = described(29, [("flags", c_uint32), ("stage", Stage), ("layout", c_uint64), ("base", c_uint64),
                          ("base_index", c_uint32)])
Layout = described(30, [("flags", c_uint32), ("sets", c_uint32), ("set", POINTER(c_uint64)), ("pushes", c_uint32),
                        ("push", c_void_p)])
SetLayout = described(32, [("flags", c_uint32), ("count", c_uint32), ("bindings", c_void_p)])
Tells = described(1000269000, [("enabled", c_uint32)])
OfPipeline = described(1000269001, [("pipeline", c_uint64)])
Executable = described(1000269003, [("pipeline", c_uint64), ("index", c_uint32)])
Statistic = described(1000269004, [("name", c_char * 256), ("text", c_char * 256), ("format", c_uint32),
                                   ("value", c_uint64)])
Properties = described(1000059001, [("core", c_char * 824)])
Driver = described(1000196000, [("id", c_uint32), ("name", c_char * 256), ("info", c_char * 256),
                                ("conformance", c_uint32)])


class Binding(Structure):
    _fields_ = [("binding", c_uint32), ("type", c_uint32), ("count", c_uint32), ("stages", c_uint32),
                ("samplers", c_void_p)]


class Entry(Structure):
    _fields_ = [("id", c_uint32), ("offset", c_uint32), ("bytes", c_size_t)]


class Specialisation(Structure):
    _fields_ = [("count", c_uint32), ("entries", POINTER(Entry)), ("bytes", c_size_t), ("values", POINTER(c_uint32))]


def bindings_of(code):
    """{binding: descriptor type} of a SPIR-V module: storage buffers and texel buffers."""
    words = struct.unpack(f"<{len(code) // 4}I", code)
    bindings, variables, at = {}, {}, 5
    while at < len(words):
        count, op = words[at] >> 16, words[at] & 0xFFFF
        if op == 71 and words[at + 2] == 33:  # OpDecorate, Binding
            bindings[words[at + 1]] = words[at + 3]
        if op == 59:  # OpVariable
            variables[words[at + 2]] = words[at + 3]
        at += count
    return {number: STORAGE_BUFFER if variables[name] == 12 else TEXEL_BUFFER for name, number in bindings.items()}


class Vulkan:
    """One device, opened to make pipelines."""

    def __init__(self):
        self.library = ctypes.CDLL("libvulkan.so.1")
        application = Application(name=b"pipeline_statistics", api=1 << 22 | 2 << 12)
        self.instance, self.physical, self.device = c_void_p(), c_void_p(), c_void_p()
        made = Instance(application=ctypes.pointer(application))
        if self.library.vkCreateInstance(byref(made), None, byref(self.instance)) != 0:
            sys.exit("pipeline_statistics: no Vulkan driver")
        count = c_uint32(1)
        self.library.vkEnumeratePhysicalDevices(self.instance, byref(count), byref(self.physical))
        if count.value == 0 or not self.physical:
            sys.exit("pipeline_statistics: the driver has no device")
        self.open()
        self.get = self.library.vkGetDeviceProcAddr
        self.get.restype, self.get.argtypes = c_void_p, [c_void_p, c_char_p]

    def open(self):
        priority = c_float(1)
        queue = Queue(family=self.compute_family(), count=1, priorities=ctypes.addressof(priority))
        tells = Tells(enabled=1)
        names = (c_char_p * 1)(STATISTICS)
        made = Device(next=ctypes.addressof(tells), queues=1, queue=ctypes.pointer(queue), extensions=1,
                      extension_names=names)
        status = self.library.vkCreateDevice(self.physical, byref(made), None, byref(self.device))
        if status != 0:
            sys.exit(f"pipeline_statistics: vkCreateDevice with {STATISTICS.decode()}: VkResult {status}")

    def compute_family(self):
        families, count = (c_uint32 * 6 * 16)(), c_uint32(16)
        self.library.vkGetPhysicalDeviceQueueFamilyProperties(self.physical, byref(count), byref(families))
        return next(i for i in range(count.value) if families[i][0] & 2)

    def names(self):
        driver = Driver()
        properties = Properties(next=ctypes.addressof(driver))
        self.library.vkGetPhysicalDeviceProperties2(self.physical, byref(properties))
        raw = ctypes.string_at(ctypes.addressof(properties) + Properties.core.offset + 20, 256)
        return {"device": raw.split(b"\0")[0].decode(), "driver": f"{driver.name.decode()} {driver.info.decode()}"}

    def call(self, name, *arguments):
        """The VkResult of a function of the device."""
        function = ctypes.CFUNCTYPE(ctypes.c_int32, *[type(one) if isinstance(one, (c_void_p, c_uint64, c_uint32))
                                                      else c_void_p for one in (self.device, *arguments)])
        return function(self.get(self.device, name))(self.device, *arguments)

    def made(self, name, description):
        handle = c_uint64()
        status = self.call(name, ctypes.addressof(description), None, ctypes.addressof(handle))
        return handle if status == 0 else None

    def statistics(self, code, constants):
        """The VkResult of a pipeline, and its statistics by the driver's names."""
        kinds = bindings_of(code)
        bindings = (Binding * len(kinds))(*[Binding(n, kinds[n], 1, COMPUTE, None) for n in sorted(kinds)])
        set_layout = self.made(b"vkCreateDescriptorSetLayout",
                               SetLayout(count=len(kinds), bindings=ctypes.addressof(bindings)))
        push = (c_uint32 * 3)(COMPUTE, 0, PUSH_BYTES)
        layout = set_layout and self.made(b"vkCreatePipelineLayout", Layout(
            sets=1, set=ctypes.pointer(set_layout), pushes=1, push=ctypes.addressof(push)))
        module = self.made(b"vkCreateShaderModule", Module(bytes=len(code), code=code))
        if layout is None or module is None:
            return -13, {}
        entries = (Entry * len(constants))(*[Entry(name, 4 * i, 4) for i, name in enumerate(constants)])
        values = (c_uint32 * len(constants))(*constants.values())
        special = Specialisation(len(constants), entries, 4 * len(constants), values)
        stage = Stage(stage=COMPUTE, module=module.value, entry=b"main", specialisation=ctypes.addressof(special))
        wanted = Pipeline(flags=CAPTURE_STATISTICS | DISPATCH_BASE, stage=stage, layout=layout.value)
        pipeline = c_uint64()
        status = self.call(b"vkCreateComputePipelines", c_uint64(0), c_uint32(1), ctypes.addressof(wanted), None,
                           ctypes.addressof(pipeline))
        return status, self.told(pipeline) if status == 0 else {}

    def told(self, pipeline):
        """Statistics of a pipeline's executables; of several, as Intel's of 8, 16 and 32 lanes, those of the last."""
        count, found = c_uint32(), {}
        of = OfPipeline(pipeline=pipeline.value)
        self.call(b"vkGetPipelineExecutablePropertiesKHR", ctypes.addressof(of), ctypes.addressof(count), None)
        for index in range(count.value):
            executable, number = Executable(pipeline=pipeline.value, index=index), c_uint32()
            ask = (b"vkGetPipelineExecutableStatisticsKHR", ctypes.addressof(executable), ctypes.addressof(number))
            self.call(*ask, None)
            rows = (Statistic * number.value)()
            for row in rows:
                row.type = Statistic.TYPE
            self.call(*ask, ctypes.addressof(rows))
            for row in rows:
                value = row.value
                if row.format == 3:
                    value = struct.unpack("<d", struct.pack("<Q", value))[0]
                found[row.name.decode()] = value
        return found


def main():
    vulkan = Vulkan()
    print(json.dumps(vulkan.names()), flush=True)
    for line in sys.stdin:
        path, *constants = line.split()
        print(json.dumps({"start": line.strip()}), flush=True)
        with open(path, "rb") as file:
            code = file.read()
        status, found = vulkan.statistics(code, {int(name): int(value) for name, value in
                                                 (pair.split("=") for pair in constants)})
        print(json.dumps({"vulkan": status, "statistics": found}), flush=True)


if __name__ == "__main__":
    main()
