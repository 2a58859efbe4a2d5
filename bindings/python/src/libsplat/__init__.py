"""libsplat: 3D Gaussians from pictures, drawn and trained on any Vulkan device.

    import libsplat as splat
    scene = splat.Predictor().predict("photo.png").scene
    splat.render(scene, splat.Camera.orbit(scene, 1)[0]).save("view.png")

Errors are subclasses of `Error` and of Python's usual classes. Objects are closed by `close`, by a
`with` block, or when they are collected, in any order.
"""
from enum import Enum as _Enum

from ._dlpack import CudaArray, ExternalMemory
from ._errors import (Cancelled, DeviceLost, Error, FormatError, InternalError, InvalidArgument,
                      InvalidHandle, InvalidState, IoError, MissingName, NoDevice, NotFound,
                      OutOfDeviceMemory, OutOfHostMemory, OutOfMemory, ShapeMismatch, Timeout,
                      Unsupported)
from ._library import lib as _lib
from ._native import (Access, Convention, DeviceKind, DrawnFlags, Dtype, Found, Frame, Kernels, LogLevel,
                      Metric, Output, Pixel, Precision, Result, RunEventKind, SceneFormat, SkipFlags,
                      Verdict)
from ._text import check_class as _check_class, checked as _checked
from .camera import Camera, cameras_to_bytes, save_cameras
from .dataset import (Dataset, MeshViews, config_keys, config_merge, config_preset, config_presets,
                      config_warnings, export_dataset, import_tables, path_name,
                      prepare_co3d, write_synthetic, write_tokens)
from .device import Device, default_device, describe, devices
from .evaluator import Comparison, EvaluatedViews, Evaluator, Lpips
from .image import Image, animation_to_bytes, compare_images, save_animation
from .log import set_decode_limits, set_log
from .model import Model, Port
from .module import Module, Op, operators
from .optimizer import Group, Optimizer
from .picture import Picture, cut_picture
from .predictor import Prediction, Predictor
from .priors import (Mesh, PriorModel, compare_depth, compare_fidelity, compare_masks, compare_normals,
                     compare_planes, depth_points, filter_map, mesh_points, normals_from_depth,
                     picture_mask, planes_from_depth, prior_preset, prior_preset_text, prior_presets)
from .rasterizer import RasterState, Rasterizer, render
from .run import Event, Fit, Run, Scoring
from .scene import Scene, scene_formats
from .tensor import Tensor
from .training import Batch, Batches, Ranks, Trainer, Training
from .weights import Weights, builtin_weights

__version__ = str(_lib.splat_version_string().decode())

__all__ = [
    "Access", "Batch", "Batches", "Camera", "Cancelled", "Comparison", "Convention", "CudaArray", "Dataset",
    "Device", "DeviceKind", "DeviceLost", "DrawnFlags", "Dtype", "Error", "EvaluatedViews", "Evaluator", "Event",
    "ExternalMemory", "Fit", "FormatError", "Found", "Frame", "Group", "Image", "InternalError", "InvalidArgument",
    "InvalidHandle", "InvalidState", "IoError", "Kernels", "LogLevel", "Lpips", "Mesh", "MeshViews", "Metric",
    "MissingName", "Model", "Module", "NoDevice", "NotFound", "Op", "Optimizer", "OutOfDeviceMemory", "OutOfHostMemory",
    "OutOfMemory", "Output", "Picture", "Pixel", "Port", "Precision", "Prediction", "Predictor",
    "PriorModel", "Ranks", "RasterState", "Rasterizer", "Result", "Run", "RunEventKind", "Scene",
    "SceneFormat", "Scoring", "ShapeMismatch", "SkipFlags", "Tensor", "Timeout", "Trainer", "Training",
    "Unsupported", "Verdict", "Weights", "animation_to_bytes", "builtin_weights", "cameras_to_bytes",
    "compare_depth", "compare_fidelity", "compare_images", "compare_masks", "compare_normals", "compare_planes",
    "config_keys", "config_merge", "config_preset", "config_presets", "config_warnings",
    "cut_picture", "default_device", "depth_points", "describe", "devices", "export_dataset",
    "filter_map", "import_tables", "mesh_points", "normals_from_depth", "operators", "path_name",
    "picture_mask", "planes_from_depth",
    "prepare_co3d", "prior_preset",
    "prior_preset_text", "prior_presets", "render", "save_animation", "save_cameras",
    "scene_formats", "set_decode_limits", "set_log", "write_synthetic", "write_tokens",
]

for _name in __all__:
    _each = globals()[_name]
    _each.__module__ = "libsplat"  # what tracebacks and help call it
    if not isinstance(_each, type):
        globals()[_name] = _checked(_each)
    elif not issubclass(_each, (BaseException, _Enum)):
        _check_class(_each)
