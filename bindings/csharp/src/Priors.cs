using System;
using System.Threading.Tasks;
using Splat.Interop;

namespace Splat
{
    /// <summary>
    /// How good depth maps, normals and masks are, and points of shapes. Maps are pictures of one
    /// size; numbers that are not finite are refused, except where a mask leaves them out.
    /// </summary>
    public static unsafe class Priors
    {
        /// <summary>Errors of a depth map after its alignment with the least squares.</summary>
        /// <param name="prediction">of one channel</param>
        /// <param name="truth">of one channel</param>
        /// <param name="mask">pixels above 0.5 count; null: those with a truth above 0</param>
        /// <param name="flags">AsPublished: every pixel counts</param>
        public static DepthScores CompareDepth(Image prediction, Image truth, Image? mask = null,
                                               DepthFlags flags = DepthFlags.None)
        {
            using (var arena = new Arena())
            {
                splat_image a = Native(prediction, nameof(prediction), arena);
                splat_image b = Native(truth, nameof(truth), arena);
                splat_image m = mask == null ? new splat_image() : mask.ToNative(arena);
                var scores = new splat_depth_scores { struct_size = (uint)sizeof(splat_depth_scores) };
                Check.Ok(Interop.Native.splat_prior_compare_depth(
                    &a, &b, mask == null ? null : &m, flags, &scores));
                return new DepthScores(&scores);
            }
        }

        /// <summary>Angles between normals, in degrees.</summary>
        /// <param name="prediction">of three channels</param>
        /// <param name="truth">of three channels</param>
        /// <param name="mask">pixels above 0.5 count; null: those with a true normal</param>
        /// <param name="flags">Vectors: numbers are x, y, z, not (n + 1) / 2</param>
        public static NormalScores CompareNormals(Image prediction, Image truth, Image? mask = null,
                                                  NormalFlags flags = NormalFlags.None)
        {
            using (var arena = new Arena())
            {
                splat_image a = Native(prediction, nameof(prediction), arena);
                splat_image b = Native(truth, nameof(truth), arena);
                splat_image m = mask == null ? new splat_image() : mask.ToNative(arena);
                var scores = new splat_normal_scores { struct_size = (uint)sizeof(splat_normal_scores) };
                Check.Ok(Interop.Native.splat_prior_compare_normals(
                    &a, &b, mask == null ? null : &m, flags, &scores));
                return new NormalScores(&scores);
            }
        }

        /// <summary>Covering, recall and precision of planes, as PlanesFromDepth gives them.</summary>
        /// <param name="prediction">of four channels</param>
        /// <param name="truth">of four channels</param>
        /// <param name="maxDistance">most difference of the distances of a plane that is found</param>
        /// <param name="maxDegrees">most angle between its normals</param>
        /// <param name="flags">None: normals are (n + 1) / 2</param>
        public static PlaneScores ComparePlanes(Image prediction, Image truth, double maxDistance = 0.05,
                                                double maxDegrees = 10,
                                                NormalFlags flags = NormalFlags.Vectors)
        {
            using (var arena = new Arena())
            {
                splat_image a = Native(prediction, nameof(prediction), arena);
                splat_image b = Native(truth, nameof(truth), arena);
                var scores = new splat_plane_scores { struct_size = (uint)sizeof(splat_plane_scores) };
                Check.Ok(Interop.Native.splat_prior_compare_planes(
                    &a, &b, flags, maxDistance, maxDegrees, &scores));
                return new PlaneScores(&scores);
            }
        }

        /// <summary>Overlap of a soft mask with the true one.</summary>
        public static MaskScores CompareMasks(Image prediction, Image alpha,
                                              MaskFlags flags = MaskFlags.None)
        {
            using (var arena = new Arena())
            {
                splat_image a = Native(prediction, nameof(prediction), arena);
                splat_image b = Native(alpha, nameof(alpha), arena);
                var scores = new splat_mask_scores { struct_size = (uint)sizeof(splat_mask_scores) };
                Check.Ok(Interop.Native.splat_prior_compare_masks(&a, &b, flags, &scores));
                return new MaskScores(&scores);
            }
        }

        /// <summary>Visual information fidelity of images of at least 41 x 41 pixels.</summary>
        public static FidelityScores CompareFidelity(Image prediction, Image truth,
                                                     FidelityFlags flags = FidelityFlags.None)
        {
            using (var arena = new Arena())
            {
                splat_image a = Native(prediction, nameof(prediction), arena);
                splat_image b = Native(truth, nameof(truth), arena);
                var scores = new splat_fidelity_scores { struct_size = (uint)sizeof(splat_fidelity_scores) };
                Check.Ok(Interop.Native.splat_prior_compare_images(&a, &b, flags, &scores));
                return new FidelityScores(&scores);
            }
        }

        /// <summary>Edges of a map, or a mask without holes or specks, as a picture of Pixel.F32.</summary>
        public static Image FilterMap(Image map, MapFilter filter)
        {
            using (var arena = new Arena())
            {
                splat_image from = Native(map, nameof(map), arena);
                var filtered = new Image(map.Width, map.Height, 1, Pixel.F32);
                splat_image to = filtered.ToNative(arena);
                Check.Ok(Interop.Native.splat_prior_filter(&from, filter, &to));
                return filtered;
            }
        }

        /// <summary>
        /// The object of a picture without a network: by an alpha that is not opaque everywhere, else by
        /// the colour of its border. A mask of bytes, 255 on the object.
        /// </summary>
        public static Image PictureMask(Image picture, out Found found)
        {
            using (var arena = new Arena())
            {
                splat_image from = Native(picture, nameof(picture), arena);
                var mask = new Image(picture.Width, picture.Height, 1, Pixel.U8);
                splat_image to = mask.ToNative(arena);
                Found how;
                Check.Ok(Interop.Native.splat_picture_mask(&from, &to, &how));
                found = how;
                return mask;
            }
        }

        /// <summary>
        /// Normals of the surface that a depth map shows, (n + 1) / 2 in the camera's axes, as a
        /// picture of Pixel.F32.
        /// </summary>
        /// <param name="depth">of one channel</param>
        /// <param name="focal">pixels; the principal point is in the middle</param>
        /// <param name="nearest">distance of the number 1; both 0: the map holds distances</param>
        /// <param name="farthest">distance of the number 0</param>
        public static Image NormalsFromDepth(Image depth, double focal, double nearest = 0,
                                             double farthest = 0)
        {
            using (var arena = new Arena())
            {
                splat_image from = Native(depth, nameof(depth), arena);
                splat_normals_desc desc = CameraOf(focal, nearest, farthest);
                var normal = new Image(depth.Width, depth.Height, 3, Pixel.F32);
                splat_image to = normal.ToNative(arena);
                Check.Ok(Interop.Native.splat_normals_from_depth(&from, &desc, &to));
                return normal;
            }
        }

        /// <summary>
        /// Planes of the surface that a depth map shows, as a picture of Pixel.F32 with 4 channels: the normal of
        /// each pixel's plane in the camera's axes, and its distance; 0 without a plane.
        /// </summary>
        /// <param name="depth">of one channel</param>
        /// <param name="focal">pixels; the principal point is in the middle</param>
        /// <param name="normal">x, y, z of normals; null: by differences of the depth</param>
        /// <param name="nearest">distance of the number 1; both 0: the map holds distances</param>
        /// <param name="farthest">distance of the number 0</param>
        /// <param name="maxDegrees">most angle between a pixel's normal and its plane's; 0: 15</param>
        /// <param name="maxOffset">most distance of a pixel from its plane, as a share of its depth; 0: 0.02</param>
        /// <param name="leastShare">share of the pixels of the smallest plane; 0: 0.005</param>
        public static Image PlanesFromDepth(Image depth, double focal, Image? normal = null,
                                            double nearest = 0, double farthest = 0,
                                            double maxDegrees = 0, double maxOffset = 0,
                                            double leastShare = 0)
        {
            using (var arena = new Arena())
            {
                splat_image from = Native(depth, nameof(depth), arena);
                splat_image n = normal == null ? new splat_image() : normal.ToNative(arena);
                splat_normals_desc camera = CameraOf(focal, nearest, farthest);
                var desc = new splat_planes_desc
                {
                    struct_size = (uint)sizeof(splat_planes_desc),
                    flags = NormalFlags.Vectors,
                    max_degrees = maxDegrees,
                    max_offset = maxOffset,
                    least_share = leastShare,
                };
                var plane = new Image(depth.Width, depth.Height, 4, Pixel.F32);
                splat_image to = plane.ToNative(arena);
                Check.Ok(Interop.Native.splat_planes_from_depth(
                    &from, normal == null ? null : &n, &camera, &desc, &to, null));
                return plane;
            }
        }

        private static splat_normals_desc CameraOf(double focal, double nearest, double farthest) =>
            new splat_normals_desc
            {
                struct_size = (uint)sizeof(splat_normals_desc),
                focal_x = focal,
                focal_y = focal,
                nearest = nearest,
                farthest = farthest,
            };

        /// <summary>Points on the surface of an OBJ file, uniform by area: x, y, z of each.</summary>
        public static float[] MeshPoints(string path, int count, long seed = 0)
        {
            using (var arena = new Arena())
            {
                byte* name = arena.Text(path, nameof(path));
                ulong first = Check.Unsigned(seed, nameof(seed));
                float[] points = Values.New<float>("points", 3, Check.Unsigned(count, nameof(count)));
                Check.Ok(Interop.Native.splat_points_from_mesh(
                    name, first, (float*)arena.Pin(points), (ulong)points.Length));
                return points;
            }
        }

        /// <summary>
        /// The points of the world that a depth map shows, x, y, z of each: distances along the
        /// camera's axis.
        /// </summary>
        public static float[] DepthPoints(Image depth, Camera camera)
        {
            using (var arena = new Arena())
            {
                splat_image from = Native(depth, nameof(depth), arena);
                splat_camera seen = Check.NotNull(camera, nameof(camera)).ToNative();
                float[] points = Values.New<float>("points", 3, depth.Width, depth.Height);
                ulong needed = 0;
                Check.Ok(Interop.Native.splat_points_from_depth(
                    &from, &seen, (float*)arena.Pin(points), (ulong)points.Length, &needed));
                Array.Resize(ref points, (int)needed);
                return points;
            }
        }

        private static splat_image Native(Image image, string name, Arena arena) =>
            Check.NotNull(image, name).ToNative(arena);
    }

    /// <summary>Maps of a picture; null: not wanted. All of its size.</summary>
    public sealed class PriorMaps
    {
        /// <summary>1 channel; larger is nearer.</summary>
        public Image? Depth { get; set; }
        /// <summary>3 channels.</summary>
        public Image? Normal { get; set; }
        /// <summary>1 channel; 1 (U8: 255) on the object.</summary>
        public Image? Mask { get; set; }
    }

    /// <summary>A network that makes depth, normals and masks of pictures: an ONNX file that ONNX Runtime
    /// runs. Needs no device; thread-safe.</summary>
    public sealed unsafe class PriorModel : NativeObject<SafePriorModelHandle>
    {
        /// <summary>Load a model.</summary>
        /// <param name="preset">a name, or JSON of one's own; null: by the name of the file</param>
        /// <param name="model">the file; null: the preset's, in the folder of models</param>
        /// <param name="runtime">library of ONNX Runtime; null: where libsplat looks for it</param>
        /// <param name="threads">of one run; 0: one per core</param>
        /// <param name="flags">whether float maps have the model's own numbers</param>
        /// <param name="device">of weights; null for an ONNX file</param>
        /// <param name="tokens">patches of a picture, for presets that have them; 0: the preset's</param>
        public PriorModel(string preset, string? model = null, string? runtime = null, int threads = 0,
                          PriorModelFlags flags = PriorModelFlags.None, Device? device = null,
                          int tokens = 0)
            : base(Create(preset, model, runtime, threads, flags, device, tokens))
        {
        }

        private static SafePriorModelHandle Create(string preset, string? model, string? runtime,
            int threads, PriorModelFlags flags, Device? device, int tokens)
        {
            using (var arena = new Arena())
            {
                var desc = new splat_prior_model_desc
                {
                    struct_size = (uint)sizeof(splat_prior_model_desc),
                    flags = flags,
                    preset = arena.Optional(preset, nameof(preset)),
                    model_path = arena.Optional(model, nameof(model)),
                    runtime_path = arena.Optional(runtime, nameof(runtime)),
                    threads = Check.Unsigned(threads, nameof(threads)),
                    tokens = Check.Unsigned(tokens, nameof(tokens)),
                    device = arena.Hold(device),
                };
                IntPtr handle;
                Check.Ok(Native.splat_prior_model_create(&desc, &handle));
                return new SafePriorModelHandle(handle, true);
            }
        }

        /// <summary>JSON of a preset, and where its model is had; null: an array of all names.</summary>
        public static string Preset(string? name = null)
        {
            using (var arena = new Arena())
            {
                byte* text = arena.Optional(name, nameof(name));
                return Text.Get((buffer, capacity, needed) =>
                    Native.splat_prior_preset(text, buffer, capacity, needed));
            }
        }

        /// <summary>What it makes, its licence, the size of its input.</summary>
        public PriorModelInfo Info
        {
            get
            {
                using (var arena = new Arena())
                {
                    arena.Hold(this);  // the texts live as long as the model
                    SafePriorModelHandle handle = Handle;
                    var info = new splat_prior_model_info
                        { struct_size = (uint)sizeof(splat_prior_model_info) };
                    Check.Ok(Native.splat_prior_model_get_info(handle, &info));
                    return new PriorModelInfo(&info);
                }
            }
        }

        internal override string About => Info.Preset;

        /// <summary>Fill maps of a picture on another thread; it and they must stay until the task ends.</summary>
        public Task RunAsync(Image picture, PriorMaps maps) => Task.Run(() => Run(picture, maps));

        /// <summary>Fill maps of a picture.</summary>
        public void Run(Image picture, PriorMaps maps)
        {
            Check.NotNull(maps, nameof(maps));
            using (var arena = new Arena())
            {
                splat_image from = Check.NotNull(picture, nameof(picture)).ToNative(arena);
                splat_prior_maps to = ToNative(maps, arena);
                Check.Ok(Native.splat_prior_model_run(Handle, &from, &to, 1));
            }
        }

        /// <summary>
        /// Fill maps of a picture. Returns the focal length of its camera, pixels; 0 if the model does not tell it.
        /// </summary>
        public double RunFocal(Image picture, PriorMaps maps)
        {
            Check.NotNull(maps, nameof(maps));
            using (var arena = new Arena())
            {
                splat_image from = Check.NotNull(picture, nameof(picture)).ToNative(arena);
                splat_prior_maps to = ToNative(maps, arena);
                double focal;
                Check.Ok(Native.splat_prior_model_run_focal(Handle, &from, &to, &focal, 1));
                return focal;
            }
        }

        private static splat_prior_maps ToNative(PriorMaps maps, Arena arena) => new splat_prior_maps
        {
            depth = maps.Depth == null ? default : maps.Depth.ToNative(arena),
            normal = maps.Normal == null ? default : maps.Normal.ToNative(arena),
            mask = maps.Mask == null ? default : maps.Mask.ToNative(arena),
        };
    }
}
