using System;
using System.Collections.Generic;
using System.Linq;
using System.Runtime.InteropServices;
using Splat.Interop;

namespace Splat
{
    /// <summary>A circle of cameras around a scene; the defaults fill the image.</summary>
    public sealed class OrbitOptions
    {
        /// <summary>Pixels; 0: 512.</summary>
        public int Width { get; set; }
        /// <summary>Pixels; 0: 512.</summary>
        public int Height { get; set; }
        /// <summary>Horizontal field of view, radians; 0: 0.7.</summary>
        public double FovX { get; set; }
        /// <summary>Radians above the horizon.</summary>
        public double Elevation { get; set; }
        /// <summary>Angle of the first camera, radians.</summary>
        public double Start { get; set; }
        /// <summary>From the centre, scene units; 0: the scene fills the image.</summary>
        public double Distance { get; set; }
        /// <summary>A direction of the world; null: 0, -1, 0.</summary>
        public double[]? Up { get; set; }
    }

    /// <summary>How to read a file of cameras.</summary>
    public sealed class CameraFileOptions
    {
        /// <summary>What to do about lens distortion.</summary>
        public CameraFlags Flags { get; set; }
        /// <summary>Pixels, for a transforms.json without size; else 0.</summary>
        public int Width { get; set; }
        /// <summary>Pixels, as Width.</summary>
        public int Height { get; set; }

        internal unsafe splat_camera_file_desc ToNative()
        {
            return new splat_camera_file_desc
            {
                struct_size = (uint)sizeof(splat_camera_file_desc),
                flags = Flags,
                width = Check.Unsigned(Width, nameof(Width)),
                height = Check.Unsigned(Height, nameof(Height)),
            };
        }
    }

    /// <summary>A pinhole camera. Never changes: With gives another one.</summary>
    public sealed unsafe class Camera : Facts<Camera>
    {
        private readonly splat_camera native;

        internal Camera(splat_camera native)
        {
            this.native = native;
            WorldToCamera = Values.List<double>(native.world_to_camera, 16);
        }

        /// <summary>Make a camera of its numbers; what Render would refuse is refused here.</summary>
        /// <param name="width">pixels</param>
        /// <param name="height">pixels</param>
        /// <param name="fx">focal length, pixels</param>
        /// <param name="fy">focal length, pixels</param>
        /// <param name="cx">principal point, pixels</param>
        /// <param name="cy">principal point, pixels</param>
        /// <param name="worldToCamera">
        /// 16 numbers, row-major; axes of the camera: x right, y down, z forward; null: identity
        /// </param>
        public Camera(int width, int height, double fx, double fy, double cx, double cy,
                      IReadOnlyList<double>? worldToCamera = null)
            : this(Checked(new splat_camera
            {
                width = Check.Unsigned(width, nameof(width)),
                height = Check.Unsigned(height, nameof(height)),
                fx = fx,
                fy = fy,
                cx = cx,
                cy = cy,
            }, worldToCamera?.ToArray() ?? Identity))
        {
        }

        private static readonly double[] Identity = { 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1 };

        private static splat_camera Checked(splat_camera made, double[] worldToCamera)
        {
            Library.Ensure();
            double[] m = worldToCamera;
            Check.Numbers<double>(m, 16, nameof(worldToCamera));
            double size = m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) +
                          m[2] * (m[4] * m[9] - m[5] * m[8]);
            string? problem = m.Any(v => double.IsNaN(v) || double.IsInfinity(v)) ? "numbers that are not finite"
                : !m.Skip(12).SequenceEqual(Identity.Skip(12)) ? "another last row than 0 0 0 1: is it transposed?"
                : !(size > 1e-9) ? "a rotation whose determinant is not about 1" : null;
            if (problem != null) throw new ArgumentException("the pose has " + problem, nameof(worldToCamera));
            for (int i = 0; i < 16; ++i) made.world_to_camera[i] = Identity[i];  // files take fewer poses
            UIntPtr needed;
            try
            {
                Check.Ok(Native.splat_camera_save_memory(&made, null, 1, null, UIntPtr.Zero, &needed));
            }
            catch (SplatException error)
            {
                throw new SplatException(error.Code, error.Message.Replace("'cameras[0]'", "refused"));
            }
            for (int i = 0; i < 16; ++i) made.world_to_camera[i] = m[i];
            return made;
        }

        /// <summary>This camera with some numbers changed; null: as it is.</summary>
        public Camera With(int? width = null, int? height = null, double? fx = null, double? fy = null,
                           double? cx = null, double? cy = null, IReadOnlyList<double>? worldToCamera = null) =>
            new Camera(width ?? Width, height ?? Height, fx ?? Fx, fy ?? Fy, cx ?? Cx, cy ?? Cy,
                       worldToCamera ?? WorldToCamera);

        /// <summary>Pixels.</summary>
        public int Width => (int)native.width;
        /// <summary>Pixels.</summary>
        public int Height => (int)native.height;
        /// <summary>Focal length, pixels.</summary>
        public double Fx => native.fx;
        /// <summary>Focal length, pixels.</summary>
        public double Fy => native.fy;
        /// <summary>Principal point, pixels.</summary>
        public double Cx => native.cx;
        /// <summary>Principal point, pixels.</summary>
        public double Cy => native.cy;

        /// <summary>The pose: 16 numbers, row-major.</summary>
        public IReadOnlyList<double> WorldToCamera { get; }

        /// <inheritdoc/>
        public override bool Equals(Camera? other)  // by hand: cameras are many
        {
            if (ReferenceEquals(other, null)) return false;
            bool same = Numbers.Equals(other.Numbers);
            for (int i = 0; same && i < 16; ++i) same = WorldToCamera[i].Equals(other.WorldToCamera[i]);
            return same;
        }

        /// <inheritdoc/>
        public override int GetHashCode() =>
            WorldToCamera.Aggregate(Numbers.GetHashCode(), (hash, v) => unchecked(31 * hash + v.GetHashCode()));

        private (int, int, double, double, double, double) Numbers => (Width, Height, Fx, Fy, Cx, Cy);

        internal splat_camera ToNative() => native;

        /// <summary>Cameras as the library takes them.</summary>
        internal static splat_camera[] ToNative(IReadOnlyList<Camera> cameras)
        {
            var natives = new splat_camera[cameras.Count];
            for (int i = 0; i < natives.Length; ++i)
                natives[i] = Check.NotNull(cameras[i], "cameras[" + i + "]").native;
            return natives;
        }

        internal static Camera[] FromNative(splat_camera[] natives) =>
            Array.ConvertAll(natives, native => new Camera(native));

        /// <summary>
        /// A camera with a horizontal field of view in radians, square pixels, the principal point
        /// in the middle, and the identity as its pose.
        /// </summary>
        public static Camera FromFov(int width, int height, double fovX)
        {
            Library.Ensure();
            splat_camera camera;
            Check.Ok(Native.splat_camera_from_fov(Check.Unsigned(width, nameof(width)),
                                                  Check.Unsigned(height, nameof(height)), fovX,
                                                  &camera));
            return new Camera(camera);
        }

        /// <summary>This camera at `eye`, looking at `target`, with `up` upwards in the image.</summary>
        public Camera LookAt(ReadOnlySpan<double> eye, ReadOnlySpan<double> target, ReadOnlySpan<double> up)
        {
            splat_camera camera = native;
            fixed (double* e = &MemoryMarshal.GetReference(Check.Numbers(eye, 3, nameof(eye))))
            fixed (double* t = &MemoryMarshal.GetReference(Check.Numbers(target, 3, nameof(target))))
            fixed (double* u = &MemoryMarshal.GetReference(Check.Numbers(up, 3, nameof(up))))
                Check.Ok(Native.splat_camera_look_at(&camera, e, t, u));
            return new Camera(camera);
        }

        /// <summary>
        /// This camera with the pose of an OpenGL camera-to-world matrix (NeRF's transform_matrix),
        /// 16 numbers, row-major.
        /// </summary>
        public Camera WithOpenGl(ReadOnlySpan<double> cameraToWorld)
        {
            splat_camera camera = native;
            Check.Numbers(cameraToWorld, 16, nameof(cameraToWorld));
            fixed (double* matrix = &MemoryMarshal.GetReference(cameraToWorld))
                Check.Ok(Native.splat_camera_from_opengl(&camera, matrix));
            return new Camera(camera);
        }

        /// <summary>The pose as such a matrix.</summary>
        public double[] ToOpenGl()
        {
            splat_camera camera = native;
            var matrix = new double[16];
            fixed (double* to = matrix)
                Check.Ok(Native.splat_camera_to_opengl(&camera, to));
            return matrix;
        }

        /// <summary>Cameras at equal angles on a circle around the centre of a scene.</summary>
        public static Camera[] Orbit(Scene scene, int count, OrbitOptions? options = null)
        {
            Check.NotNull(scene, nameof(scene));
            options = options ?? new OrbitOptions();
            var desc = new splat_orbit_desc
            {
                struct_size = (uint)sizeof(splat_orbit_desc),
                width = Check.Unsigned(options.Width, nameof(options.Width)),
                height = Check.Unsigned(options.Height, nameof(options.Height)),
                fov_x = options.FovX,
                elevation = options.Elevation,
                start = options.Start,
                distance = options.Distance,
            };
            if (options.Up != null) Check.Numbers<double>(options.Up, 3, nameof(options.Up));
            for (int i = 0; options.Up != null && i < 3; ++i) desc.up[i] = options.Up[i];
            splat_camera[] cameras = Values.New<splat_camera>("cameras", Check.Unsigned(count, nameof(count)));
            fixed (splat_camera* to = cameras)
            {
                splat_camera none;  // for a count of 0, which the library refuses by name
                Check.Ok(Native.splat_camera_orbit(scene.Handle, &desc, (uint)count,
                                                   to == null ? &none : to));
            }
            return FromNative(cameras);
        }

        /// <summary>
        /// Cameras along a smooth path through others, with the size and lens of the first one; a closed path returns
        /// to its first key.
        /// </summary>
        public static Camera[] Path(IReadOnlyList<Camera> keys, int count, bool closed = false)
        {
            splat_camera[] given = ToNative(Check.NotNull(keys, nameof(keys)));
            splat_camera[] cameras = Values.New<splat_camera>("cameras", Check.Unsigned(count, nameof(count)));
            fixed (splat_camera* from = given)
            fixed (splat_camera* to = cameras)
            {
                splat_camera none;  // for a count of 0
                Check.Ok(Native.splat_camera_path(from == null ? &none : from, (uint)given.Length, closed ? 1u : 0u,
                                                  (uint)count, to == null ? &none : to));
            }
            return FromNative(cameras);
        }

        /// <summary>Read a NeRF transforms.json, or a COLMAP model's folder.</summary>
        public static Camera[] Load(string path, CameraFileOptions? options = null)
        {
            using (var arena = new Arena())
            {
                splat_camera_file_desc desc = (options ?? new CameraFileOptions()).ToNative();
                byte* name = arena.Text(path, nameof(path));
                return Read((cameras, capacity, count) =>
                {
                    splat_camera_file_desc copy = desc;
                    return Native.splat_camera_load(name, &copy, cameras, capacity, count);
                });
            }
        }

        /// <summary>JSON: names of the images in the order of the cameras, and warnings.</summary>
        public static string LoadReportJson(string path, CameraFileOptions? options = null)
        {
            using (var arena = new Arena())
            {
                splat_camera_file_desc desc = (options ?? new CameraFileOptions()).ToNative();
                byte* name = arena.Text(path, nameof(path));
                return Text.Get((buffer, capacity, needed) =>
                {
                    splat_camera_file_desc copy = desc;
                    return Native.splat_camera_load_report(name, &copy, buffer, capacity, needed);
                });
            }
        }

        /// <summary>
        /// Read cameras from the bytes of a transforms.json, or of COLMAP's cameras file with that
        /// of its images.
        /// </summary>
        public static Camera[] FromBytes(ReadOnlyMemory<byte> cameraFile,
            ReadOnlyMemory<byte> imageFile = default(ReadOnlyMemory<byte>), CameraFileOptions? options = null)
        {
            using (var arena = new Arena())
            {
                splat_camera_bytes files = Files(arena, cameraFile, imageFile);
                splat_camera_file_desc desc = (options ?? new CameraFileOptions()).ToNative();
                return Read((cameras, capacity, count) =>
                {
                    splat_camera_bytes from = files;
                    splat_camera_file_desc copy = desc;
                    return Native.splat_camera_load_memory(&from, &copy, cameras, capacity, count);
                });
            }
        }

        /// <summary>The report on such bytes, see LoadReportJson.</summary>
        public static string BytesReportJson(ReadOnlyMemory<byte> cameraFile,
            ReadOnlyMemory<byte> imageFile = default(ReadOnlyMemory<byte>), CameraFileOptions? options = null)
        {
            using (var arena = new Arena())
            {
                splat_camera_bytes files = Files(arena, cameraFile, imageFile);
                splat_camera_file_desc desc = (options ?? new CameraFileOptions()).ToNative();
                return Text.Get((buffer, capacity, needed) =>
                {
                    splat_camera_bytes from = files;
                    splat_camera_file_desc copy = desc;
                    return Native.splat_camera_load_memory_report(&from, &copy, buffer, capacity, needed);
                });
            }
        }

        /// <summary>Write a NeRF transforms.json, whole or not at all.</summary>
        /// <param name="path">of the file</param>
        /// <param name="cameras">one frame each</param>
        /// <param name="names">paths of the images, as many as cameras; null: empty ones</param>
        public static void Save(string path, IReadOnlyList<Camera> cameras,
                                IReadOnlyList<string>? names = null)
        {
            splat_camera[] natives = ToSave(cameras, names);
            using (var arena = new Arena())
                Check.Ok(Native.splat_camera_save(arena.Text(path, nameof(path)),
                                                  (splat_camera*)arena.Pin(natives),
                                                  arena.Texts(names, nameof(names)), (uint)natives.Length));
        }

        /// <summary>The bytes of such a file.</summary>
        public static byte[] ToBytes(IReadOnlyList<Camera> cameras,
            IReadOnlyList<string>? names = null)
        {
            splat_camera[] natives = ToSave(cameras, names);
            using (var arena = new Arena())
            {
                var from = (splat_camera*)arena.Pin(natives);
                byte** texts = arena.Texts(names, nameof(names));
                return Text.GetBytes((buffer, capacity, needed) => Native.splat_camera_save_memory(
                    from, texts, (uint)natives.Length, buffer, capacity, needed));
            }
        }

        private static splat_camera[] ToSave(IReadOnlyList<Camera> cameras,
            IReadOnlyList<string>? names)
        {
            splat_camera[] natives = ToNative(Check.NotNull(cameras, nameof(cameras)));
            if (names != null && names.Count != cameras.Count)
                throw new ArgumentException(names.Count + " names for " + cameras.Count + " cameras",
                                            nameof(names));
            return natives;
        }

        private static splat_camera_bytes Files(Arena arena, ReadOnlyMemory<byte> cameraFile,
                                                ReadOnlyMemory<byte> images)
        {
            return new splat_camera_bytes
            {
                struct_size = (uint)sizeof(splat_camera_bytes),
                cameras = arena.Pin(Check.NotNull(cameraFile, nameof(cameraFile))),
                camera_bytes = (UIntPtr)cameraFile.Length,
                images = arena.Pin(images),
                image_bytes = (UIntPtr)images.Length,
            };
        }

        private delegate ResultCode ReadCall(splat_camera* cameras, uint capacity, uint* count);

        private static Camera[] Read(ReadCall call)
        {
            uint count;
            Check.Ok(call(null, 0, &count));
            while (true)
            {
                splat_camera[] cameras = Values.New<splat_camera>("cameras", count);
                ResultCode code;
                fixed (splat_camera* to = cameras) code = call(to, (uint)cameras.Length, &count);
                Check.Ok(code);
                if (code != ResultCode.Incomplete)
                {
                    Array.Resize(ref cameras, (int)count);
                    return FromNative(cameras);
                }
            }
        }
    }
}
