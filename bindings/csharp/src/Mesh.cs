using System;
using System.Collections.Generic;
using System.Threading;
using System.Threading.Tasks;
using Splat.Interop;

namespace Splat
{
    /// <summary>The arrays of a new mesh, row-major; those that are left out are not there.</summary>
    public sealed class MeshArrays
    {
        /// <summary>[n,3]</summary>
        public ReadOnlyMemory<double> Vertices { get; set; }
        /// <summary>[m,3], numbers of vertices</summary>
        public ReadOnlyMemory<uint> Triangles { get; set; }
        /// <summary>[n,3], of any lengths; without: those of the faces</summary>
        public ReadOnlyMemory<float> Normals { get; set; }
        /// <summary>[n,2], v from the top down</summary>
        public ReadOnlyMemory<float> Texcoords { get; set; }
        /// <summary>[n,4] RGBA, linear</summary>
        public ReadOnlyMemory<float> Colors { get; set; }
        /// <summary>sRGB and opacity of four channels of bytes, repeated</summary>
        public Image? Texture { get; set; }
        /// <summary>Linear RGB and opacity, which multiply all others.</summary>
        public float[] BaseColor { get; set; } = { 1, 1, 1, 1 };
        /// <summary>Only the side is drawn on which the corners turn counterclockwise.</summary>
        public bool SingleSided { get; set; }
    }

    /// <summary>How a mesh is drawn.</summary>
    public sealed class MeshRenderOptions
    {
        /// <summary>Samples of a pixel's side: 1, 2, 4 or 8.</summary>
        public int Samples { get; set; } = 4;
        /// <summary>RGB, sRGB, 0 to 1.</summary>
        public float[] Background { get; set; } = { 0, 0, 0 };
        /// <summary>Where the sky is; the main light comes from 45 degrees above the horizon.</summary>
        public double[] Up { get; set; } = { 0, 0, 1 };
        /// <summary>Nearer points are not there; 0: 10^-3 of the box's diagonal.</summary>
        public double NearPlane { get; set; }
        /// <summary>Colours are base colours, without light.</summary>
        public bool Unlit { get; set; }
    }

    /// <summary>Maps of a view; null: not wanted. All of the camera's size.</summary>
    public sealed class MeshMaps
    {
        /// <summary>3 channels over the background, or 4 with alpha.</summary>
        public Image? Color { get; set; }
        /// <summary>The base colour without light, in the same way.</summary>
        public Image? Albedo { get; set; }
        /// <summary>1 channel; the share of the pixel's samples that see the mesh.</summary>
        public Image? Mask { get; set; }
        /// <summary>1 channel of floats; 0: nothing.</summary>
        public Image? Depth { get; set; }
        /// <summary>3 channels of floats; 0: nothing.</summary>
        public Image? Normal { get; set; }
    }

    /// <summary>A data set that meshes are drawn into, and one of its objects.</summary>
    public sealed class MeshViewsOptions
    {
        /// <summary>Folder of the data set.</summary>
        public string? Path { get; set; }
        /// <summary>Name of the object.</summary>
        public string? Name { get; set; }
        /// <summary>"srn", "images"; null: srn.</summary>
        public string? Layout { get; set; }
        /// <summary>In names of folders; null: objects.</summary>
        public string? Category { get; set; }
        /// <summary>"train", "val", "test"; null: train.</summary>
        public string? Split { get; set; }
        /// <summary>How meshes were made ready, in words that all objects of a folder have in common.</summary>
        public string? Prepared { get; set; }
        /// <summary>Maps besides pictures, and where is up.</summary>
        public MeshViewsFlags Flags { get; set; } =
            MeshViewsFlags.Depth | MeshViewsFlags.Normal | MeshViewsFlags.Mask;
        /// <summary>With the name it decides all that is random.</summary>
        public long Seed { get; set; }
        /// <summary>Side of the images, 8 to 2048.</summary>
        public int Size { get; set; } = 128;
        /// <summary>Views of an object of train.</summary>
        public int TrainViews { get; set; } = 50;
        /// <summary>Views of an object of val and test.</summary>
        public int TestViews { get; set; } = 251;
        /// <summary>Samples of a pixel's side: 1, 2, 4 or 8.</summary>
        public int Samples { get; set; } = 4;
        /// <summary>Points on the surface; 0: none.</summary>
        public int Points { get; set; } = 10000;
        /// <summary>Where cameras stand.</summary>
        public MeshProtocol Protocol { get; set; }
        /// <summary>What is behind the object.</summary>
        public MeshBackground Background { get; set; }
        /// <summary>Distance of the cameras from the origin.</summary>
        public double Distance { get; set; } = 1.3;
        /// <summary>Field of view, radians; 0: SRN's.</summary>
        public double FovX { get; set; }
        /// <summary>Height of an orbit above the horizon, radians.</summary>
        public double Elevation { get; set; }
        /// <summary>Radians: cameras roll, and aim beside the origin, by up to this angle.</summary>
        public double Jitter { get; set; }
        /// <summary>Stops: objects are darker or brighter by up to this.</summary>
        public double Exposure { get; set; }

        internal unsafe splat_mesh_views_desc ToNative(Arena arena) => new splat_mesh_views_desc
        {
            struct_size = (uint)sizeof(splat_mesh_views_desc),
            flags = Flags,
            path = arena.Optional(Path, nameof(Path)),
            layout = arena.Optional(Layout, nameof(Layout)),
            category = arena.Optional(Category, nameof(Category)),
            split = arena.Optional(Split, nameof(Split)),
            name = arena.Optional(Name, nameof(Name)),
            prepared = arena.Optional(Prepared, nameof(Prepared)),
            seed = unchecked((ulong)Seed),
            size = Check.Unsigned(Size, nameof(Size)),
            train_views = Check.Unsigned(TrainViews, nameof(TrainViews)),
            test_views = Check.Unsigned(TestViews, nameof(TestViews)),
            samples = Check.Unsigned(Samples, nameof(Samples)),
            points = Check.Unsigned(Points, nameof(Points)),
            protocol = Protocol,
            background = Background,
            distance = Distance,
            fov_x = FovX,
            elevation = Elevation,
            jitter = Jitter,
            exposure = Exposure,
        };
    }

    /// <summary>A surface of triangles in host memory. Thread-safe.</summary>
    public sealed unsafe class Mesh : NativeObject<SafeMeshHandle>
    {
        /// <summary>Create a mesh of arrays, which are copied.</summary>
        public Mesh(MeshArrays arrays) : base(Create(Check.NotNull(arrays, nameof(arrays))))
        {
        }

        private Mesh(IntPtr handle) : base(new SafeMeshHandle(handle, true))
        {
        }

        private static SafeMeshHandle Create(MeshArrays arrays)
        {
            using (var arena = new Arena())
            {
                var desc = new splat_mesh_desc
                {
                    struct_size = (uint)sizeof(splat_mesh_desc),
                    flags = arrays.SingleSided ? MeshFlags.SingleSided : MeshFlags.None,
                    vertices = (double*)arena.Pin(arrays.Vertices),
                    vertex_count = (ulong)arrays.Vertices.Length,
                    triangles = (uint*)arena.Pin(arrays.Triangles),
                    triangle_count = (ulong)arrays.Triangles.Length,
                    normals = (float*)arena.Pin(arrays.Normals),
                    normal_count = (ulong)arrays.Normals.Length,
                    texcoords = (float*)arena.Pin(arrays.Texcoords),
                    texcoord_count = (ulong)arrays.Texcoords.Length,
                    colors = (float*)arena.Pin(arrays.Colors),
                    color_count = (ulong)arrays.Colors.Length,
                };
                Check.Numbers<float>(arrays.BaseColor, 4, nameof(arrays.BaseColor));
                for (int i = 0; i < 4; ++i) desc.base_color[i] = arrays.BaseColor[i];
                if (arrays.Texture != null)
                {
                    splat_image texture = arrays.Texture.ToNative(arena);
                    if (arrays.Texture.Type != Pixel.U8 || texture.channels != 4)
                        throw Check.Bad("Texture has other pixels than four channels of bytes", nameof(arrays));
                    desc.texture = (byte*)texture.pixels;
                    desc.texture_count = (ulong)texture.bytes;
                    desc.texture_width = texture.width;
                    desc.texture_height = texture.height;
                }
                IntPtr handle;
                Check.Ok(Native.splat_mesh_create(&desc, &handle));
                return new SafeMeshHandle(handle, true);
            }
        }

        /// <summary>Read a .obj, .glb or .gltf file with its materials and textures.</summary>
        /// <param name="path">of the file</param>
        /// <param name="lenient">leave out textures and materials that cannot be read</param>
        /// <param name="maxTriangles">refuse files with more; 0: 10^8</param>
        /// <param name="maxTexels">refuse files with more in all textures; 0: 2^27</param>
        public static Mesh Load(string path, bool lenient = false, long maxTriangles = 0, long maxTexels = 0)
        {
            using (var arena = new Arena())
            {
                var desc = new splat_mesh_file_desc
                {
                    struct_size = (uint)sizeof(splat_mesh_file_desc),
                    flags = lenient ? MeshFlags.Lenient : MeshFlags.None,
                    max_triangles = Check.Unsigned(maxTriangles, nameof(maxTriangles)),
                    max_texels = Check.Unsigned(maxTexels, nameof(maxTexels)),
                };
                IntPtr handle;
                Check.Ok(Native.splat_mesh_load(arena.Text(path, nameof(path)), &desc, &handle));
                return new Mesh(handle);
            }
        }

        /// <summary>JSON: what was left out of the mesh's file.</summary>
        public string LoadReportJson() => Text.Get(Handle, Native.splat_mesh_load_report);

        /// <summary>Counts, bounds, area, memory.</summary>
        public MeshInfo Info
        {
            get
            {
                var info = new splat_mesh_info { struct_size = (uint)sizeof(splat_mesh_info) };
                Check.Ok(Native.splat_mesh_get_info(Handle, &info));
                return new MeshInfo(&info);
            }
        }

        internal override string About => Info.Triangles + " triangles";

        /// <summary>Put the centre of the box into the origin, and make the mesh so large.</summary>
        public void Normalise(MeshSize size) => Check.Ok(Native.splat_mesh_normalise(Handle, size));

        /// <summary>Points on the surface, uniform by area: x, y, z of each.</summary>
        public float[] Sample(int count, long seed = 0)
        {
            using (var arena = new Arena())
            {
                float[] points = Values.New<float>("points", 3, Check.Unsigned(count, nameof(count)));
                Check.Ok(Native.splat_mesh_sample(Handle, Check.Unsigned(seed, nameof(seed)),
                                                  (float*)arena.Pin(points), (ulong)points.Length));
                return points;
            }
        }

        /// <summary>Fill maps of views: depth and normals are exact, at the centres of pixels.</summary>
        /// <param name="device">draws</param>
        /// <param name="cameras">one for each of `maps`</param>
        /// <param name="maps">at least one of each view</param>
        /// <param name="options">null: lit, over black</param>
        /// <param name="token">cancels all calls of the device</param>
        public void Render(Device device, IReadOnlyList<Camera> cameras, IReadOnlyList<MeshMaps> maps,
                           MeshRenderOptions? options = null,
                           CancellationToken token = default(CancellationToken))
        {
            Check.NotNull(device, nameof(device));
            splat_camera[] natives = Camera.ToNative(Check.NotNull(cameras, nameof(cameras)));
            if (Check.NotNull(maps, nameof(maps)).Count != natives.Length)
                throw Check.Bad("maps has " + maps.Count + " entries for " + natives.Length + " cameras",
                                nameof(maps));
            options = options ?? new MeshRenderOptions();
            using (var arena = new Arena())
            using (Cancellation.Of(device.Handle, token))
            {
                var desc = new splat_mesh_render_desc
                {
                    struct_size = (uint)sizeof(splat_mesh_render_desc),
                    flags = options.Unlit ? MeshFlags.Unlit : MeshFlags.None,
                    samples = Check.Unsigned(options.Samples, nameof(options.Samples)),
                    near_plane = options.NearPlane,
                };
                Check.Numbers<float>(options.Background, 3, nameof(options.Background));
                Check.Numbers<double>(options.Up, 3, nameof(options.Up));
                for (int i = 0; i < 3; ++i) desc.background[i] = options.Background[i];
                for (int i = 0; i < 3; ++i) desc.up[i] = options.Up[i];
                var to = new splat_mesh_maps[maps.Count];
                for (int i = 0; i < to.Length; ++i) to[i] = ToNative(Check.NotNull(maps[i], nameof(maps)), arena);
                Check.Ok(Native.splat_mesh_render(
                    Handle, device.Handle, (splat_camera*)arena.Pin(natives), (uint)natives.Length, &desc,
                    (splat_mesh_maps*)arena.Pin(to)), token);
            }
        }

        /// <summary>Draw on another thread, see Render.</summary>
        public Task RenderAsync(Device device, IReadOnlyList<Camera> cameras, IReadOnlyList<MeshMaps> maps,
                                MeshRenderOptions? options = null,
                                CancellationToken token = default(CancellationToken)) =>
            Task.Run(() => Render(device, cameras, maps, options, token), token);

        /// <summary>True if the object is there already, so that its mesh need not be read.</summary>
        public static bool FindViews(MeshViewsOptions options)
        {
            using (var arena = new Arena())
            {
                splat_mesh_views_desc desc = Check.NotNull(options, nameof(options)).ToNative(arena);
                int found;
                Check.Ok(Native.splat_mesh_find_views(&desc, &found));
                return found != 0;
            }
        }

        /// <summary>
        /// Draw the mesh as an object of a data set. Its folder appears whole or not at all; one that is there
        /// is kept.
        /// </summary>
        /// <param name="device">draws</param>
        /// <param name="options">which object of which data set</param>
        /// <param name="token">cancels all calls of the device</param>
        public void WriteViews(Device device, MeshViewsOptions options,
                               CancellationToken token = default(CancellationToken))
        {
            Check.NotNull(device, nameof(device));
            using (var arena = new Arena())
            using (Cancellation.Of(device.Handle, token))
            {
                splat_mesh_views_desc desc = Check.NotNull(options, nameof(options)).ToNative(arena);
                Check.Ok(Native.splat_mesh_write_views(Handle, device.Handle, &desc), token);
            }
        }

        /// <summary>Draw on another thread, see WriteViews.</summary>
        public Task WriteViewsAsync(Device device, MeshViewsOptions options,
                                    CancellationToken token = default(CancellationToken)) =>
            Task.Run(() => WriteViews(device, options, token), token);

        private static splat_mesh_maps ToNative(MeshMaps maps, Arena arena) => new splat_mesh_maps
        {
            color = maps.Color == null ? default : maps.Color.ToNative(arena),
            albedo = maps.Albedo == null ? default : maps.Albedo.ToNative(arena),
            mask = maps.Mask == null ? default : maps.Mask.ToNative(arena),
            depth = maps.Depth == null ? default : maps.Depth.ToNative(arena),
            normal = maps.Normal == null ? default : maps.Normal.ToNative(arena),
        };
    }
}
