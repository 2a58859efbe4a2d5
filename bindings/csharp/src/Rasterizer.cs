using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;
using System.Threading;
using Splat.Interop;

namespace Splat
{
    /// <summary>What a rasterizer is made for.</summary>
    public sealed class RasterizerOptions
    {
        /// <summary>Most Gaussians of a call.</summary>
        public long Gaussians { get; set; }
        /// <summary>Most cameras of a call; 0: any number, memory grows.</summary>
        public int Views { get; set; }
        /// <summary>Pixels.</summary>
        public int Width { get; set; }
        /// <summary>Pixels.</summary>
        public int Height { get; set; }
        /// <summary>0 to 3; 0 with direct colours.</summary>
        public int ShDegree { get; set; }
        /// <summary>Depth, normals, gradients, ...</summary>
        public RasterizerFlags Flags { get; set; }
        /// <summary>Skips to turn off, for measuring.</summary>
        public SkipFlags DisabledSkips { get; set; }
        /// <summary>Default: that of the original 3DGS.</summary>
        public Convention Convention { get; set; }
        /// <summary>Scene units; 0: the convention's.</summary>
        public float NearPlane { get; set; }
        /// <summary>Scene units; 0: 1e10.</summary>
        public float FarPlane { get; set; }
        /// <summary>Most (Gaussian, view) pairs of a call, as the sum of its ranges; 0: Gaussians x Views.</summary>
        public long Items { get; set; }
    }

    /// <summary>How Scene.Render draws.</summary>
    public sealed class RenderOptions
    {
        /// <summary>An output of pixels; default: RGB.</summary>
        public Output Output { get; set; } = Output.Rgb;
        /// <summary>RGB; null: black.</summary>
        public float[]? Background { get; set; }
        /// <summary>Default: that of the original 3DGS.</summary>
        public Convention Convention { get; set; }
        /// <summary>Opacity compensates for the dilation.</summary>
        public bool Antialiased { get; set; }
        /// <summary>null: as the scene's file says (SceneInfo.DrawnAs).</summary>
        public DrawnFlags? DrawnAs { get; set; }
        /// <summary>0: those of the output; 4: RGB and alpha.</summary>
        public int Channels { get; set; }
        /// <summary>Type of the samples.</summary>
        public Pixel Type { get; set; } = Pixel.U8;

        internal int PlaneCount
        {
            get
            {
                if (Check.Within(Channels, 0, 4, nameof(Channels)) != 0) return Channels;
                return Output == Output.Rgb || Output == Output.Normals ? 3 : 1;
            }
        }

        internal unsafe splat_scene_render_desc ToNative()
        {
            var native = new splat_scene_render_desc
            {
                struct_size = (uint)sizeof(splat_scene_render_desc),
                flags = (Antialiased ? RasterizerFlags.Antialiased : 0) | (RasterizerFlags)(DrawnAs ?? 0),
                as_given = DrawnAs == null ? 0u : 1u,
                output = Output,
                convention = Convention,
            };
            if (Background == null) return native;
            Check.Numbers<float>(Background, 3, nameof(Background));
            for (int i = 0; i < 3; ++i) native.background[i] = Background[i];
            return native;
        }
    }

    /// <summary>Gaussians that are tensors of the rasterizer's device.</summary>
    public sealed class Gaussians
    {
        /// <summary>[n,3] scene units.</summary>
        public Tensor? Means { get; set; }
        /// <summary>[n,3] standard deviations, scene units.</summary>
        public Tensor? Scales { get; set; }
        /// <summary>[n,4] w, x, y, z.</summary>
        public Tensor? Rotations { get; set; }
        /// <summary>[n] 0 to 1.</summary>
        public Tensor? Opacities { get; set; }
        /// <summary>[n,(degree+1)^2,3]; null with direct colours.</summary>
        public Tensor? Sh { get; set; }
        /// <summary>[n,3] direct colours, else null.</summary>
        public Tensor? Colors { get; set; }
        /// <summary>
        /// [v,ceil(H/16),ceil(W/16)] tiles of the call's views; null: all. Pixels of a tile with 0 are
        /// the background with alpha 0, and pass no gradient.
        /// </summary>
        public byte[]? ActiveTiles { get; set; }
        /// <summary>
        /// [v,2] the first Gaussian that each view of the call sees, and how many; null: all. Each range costs what
        /// a call for it would, with the same bits.
        /// </summary>
        public uint[]? ViewRanges { get; set; }
        /// <summary>Drawn instead of tensors, which are null then; else null.</summary>
        public Scene? Scene { get; set; }
    }

    /// <summary>
    /// Tensors of a backward call; V views of H x W pixels, N Gaussians of the forward call.
    /// </summary>
    public sealed class RasterGradients
    {
        /// <summary>Add to the tensors instead of overwriting them.</summary>
        public GradientFlags Flags { get; set; }
        /// <summary>In: of the loss with respect to Output.Rgb, [V,H,W,3]; null: zeros.</summary>
        public Tensor? Rgb { get; set; }
        /// <summary>In: [V,H,W].</summary>
        public Tensor? Alpha { get; set; }
        /// <summary>In: [V,H,W].</summary>
        public Tensor? Depth { get; set; }
        /// <summary>Out: [N,3]; null: not computed, so all that follow.</summary>
        public Tensor? Means { get; set; }
        /// <summary>Out: [N,3].</summary>
        public Tensor? Scales { get; set; }
        /// <summary>Out: [N,4].</summary>
        public Tensor? Rotations { get; set; }
        /// <summary>Out: [N].</summary>
        public Tensor? Opacities { get; set; }
        /// <summary>Out: [N,(degree+1)^2,3].</summary>
        public Tensor? Sh { get; set; }
        /// <summary>Out: [N,3].</summary>
        public Tensor? Colors { get; set; }
        /// <summary>Out: [V,N,2] per pixel.</summary>
        public Tensor? Means2d { get; set; }
        /// <summary>Out: [V,N,2] sums over the pixels of absolute values.</summary>
        public Tensor? Means2dAbs { get; set; }
        /// <summary>Out: [V,3,4] rows of the rotation and the translation.</summary>
        public Tensor? WorldToCamera { get; set; }
        /// <summary>Out: [V,4] fx, fy, cx, cy.</summary>
        public Tensor? Intrinsics { get; set; }
        /// <summary>Out: [N,2] sum of its weights, number of pixels, over all views.</summary>
        public Tensor? Contributions { get; set; }
    }

    /// <summary>The memory of one more forward call, with what its backward call needs.</summary>
    public sealed class RasterizerState : NativeObject<SafeRasterStateHandle>
    {
        internal RasterizerState(IntPtr handle) : base(new SafeRasterStateHandle(handle, true))
        {
        }
    }

    /// <summary>
    /// Draws Gaussians into views of up to its size, and computes gradients. The caller synchronises
    /// calls on one rasterizer and its states, except Dispose and Info. A null state is the
    /// rasterizer's own.
    /// </summary>
    public sealed unsafe class Rasterizer : NativeObject<SafeRasterizerHandle>
    {
        private readonly SafeDeviceHandle device;
        private readonly int width;
        private readonly int height;

        /// <summary>Create a rasterizer.</summary>
        public Rasterizer(Device device, RasterizerOptions options)
            : base(Create(device, Check.NotNull(options, nameof(options))))
        {
            this.device = device.Handle;
            width = options.Width;
            height = options.Height;
        }

        private static SafeRasterizerHandle Create(Device device, RasterizerOptions options)
        {
            Check.NotNull(device, nameof(device));
            var desc = new splat_rasterizer_desc
            {
                struct_size = (uint)sizeof(splat_rasterizer_desc),
                flags = options.Flags,
                gaussians = (uint)Check.Within(options.Gaussians, 0, uint.MaxValue, nameof(options.Gaussians)),
                views = Check.Unsigned(options.Views, nameof(options.Views)),
                width = Check.Unsigned(options.Width, nameof(options.Width)),
                height = Check.Unsigned(options.Height, nameof(options.Height)),
                sh_degree = Check.Unsigned(options.ShDegree, nameof(options.ShDegree)),
                disabled_skips = options.DisabledSkips,
                convention = options.Convention,
                near_plane = options.NearPlane,
                far_plane = options.FarPlane,
                items = (uint)Check.Within(options.Items, 0, uint.MaxValue, nameof(options.Items)),
            };
            IntPtr handle;
            Check.Ok(Native.splat_rasterizer_create(device.Handle, &desc, &handle));
            return new SafeRasterizerHandle(handle, true);
        }

        /// <summary>Create one more state, so that several forward calls stay alive.</summary>
        public RasterizerState CreateState() =>
            new RasterizerState(Check.Made(Handle, Native.splat_raster_state_create));

        /// <summary>Draw a scene; the images stay in the state, see Read.</summary>
        /// <param name="scene">n Gaussians, at most those of the options</param>
        /// <param name="cameras">of the rasterizer's size</param>
        /// <param name="background">3 numbers; null: black</param>
        /// <param name="state">null: the rasterizer's own</param>
        /// <param name="token">cancels all calls of the device while this one runs</param>
        public void Forward(Scene scene, IReadOnlyList<Camera> cameras, float[]? background = null,
                            RasterizerState? state = null,
                            CancellationToken token = default(CancellationToken))
        {
            Check.NotNull(scene, nameof(scene));
            splat_camera[] natives = Prepare(cameras, background);
            using (Cancellation.Of(device, token))
                fixed (splat_camera* first = natives)
                fixed (float* color = background)
                    Check.Ok(Native.splat_rasterizer_forward_scene(
                        Handle, Of(state), scene.Handle, first, (uint)natives.Length, color), token);
        }

        /// <summary>Draw Gaussians that are tensors; see the other overload.</summary>
        public void Forward(Gaussians gaussians, IReadOnlyList<Camera> cameras,
                            float[]? background = null, RasterizerState? state = null,
                            CancellationToken token = default(CancellationToken))
        {
            Check.NotNull(gaussians, nameof(gaussians));
            splat_camera[] natives = Prepare(cameras, background);
            using (var arena = new Arena())
            {
                var desc = new splat_gaussians_desc
                {
                    struct_size = (uint)sizeof(splat_gaussians_desc),
                    means = arena.Hold(gaussians.Means),
                    scales = arena.Hold(gaussians.Scales),
                    rotations = arena.Hold(gaussians.Rotations),
                    opacities = arena.Hold(gaussians.Opacities),
                    sh = arena.Hold(gaussians.Sh),
                    colors = arena.Hold(gaussians.Colors),
                    active_tiles = (byte*)arena.Pin(gaussians.ActiveTiles),
                    active_tile_count = (UIntPtr)(gaussians.ActiveTiles?.Length ?? 0),
                    view_ranges = (uint*)arena.Pin(gaussians.ViewRanges),
                    view_range_count = (UIntPtr)(gaussians.ViewRanges?.Length ?? 0),
                    scene = arena.Hold(gaussians.Scene),
                };
                using (Cancellation.Of(device, token))
                    Check.Ok(Native.splat_rasterizer_forward(
                        Handle, Of(state), &desc, (splat_camera*)arena.Pin(natives), (uint)natives.Length,
                        (float*)arena.Pin(background)), token);
            }
        }

        private static splat_camera[] Prepare(IReadOnlyList<Camera> cameras, float[]? background)
        {
            if (background != null) Check.Numbers<float>(background, 3, nameof(background));
            return Camera.ToNative(Check.NotNull(cameras, nameof(cameras)));
        }

        /// <summary>An output of the last forward call in a new array; shapes: see Output.</summary>
        public float[] Read(Output output, RasterizerState? state = null)
        {
            RasterizerInfo info = GetInfo(state);
            long pixels = (long)info.Views * height * width;
            long pairs = info.Items;
            float[] values = Values.New<float>("the output", Elements(output, pixels, pairs));
            Read(output, values, state);
            return values;
        }

        /// <summary>Copy an output of the last forward call into memory of the caller.</summary>
        public void Read(Output output, Span<float> values, RasterizerState? state = null)
        {
            fixed (float* to = &MemoryMarshal.GetReference(values))
            {
                float none;
                Check.Ok(Native.splat_rasterizer_read(
                    Handle, Of(state), output, to == null ? &none : to,
                    (UIntPtr)((long)values.Length * sizeof(float))));
            }
        }

        // Numbers of an output; 0 for one that the library will refuse.
        private static long Elements(Output output, long pixels, long pairs)
        {
            switch (output)
            {
                case Output.Rgb: case Output.Normals: return 3 * pixels;
                case Output.Alpha: case Output.Depth: case Output.ExpectedDepth:
                case Output.Contributors: case Output.Ids: case Output.MedianDepth: return pixels;
                case Output.Means2d: case Output.Radii: return 2 * pairs;
                case Output.Conics: return 3 * pairs;
                case Output.Depths: case Output.Visibility: return pairs;
                default: return 0;
            }
        }

        /// <summary>Copy an output of the last forward call to a tensor of its shape.</summary>
        public void CopyTo(Output output, Tensor tensor, RasterizerState? state = null)
        {
            Check.NotNull(tensor, nameof(tensor));
            Check.Ok(Native.splat_rasterizer_output(Handle, Of(state), output, tensor.Handle));
        }

        /// <summary>
        /// A view of an image output as a picture. Output.Rgb has 3 channels, or 4 with alpha; the
        /// others have 1, normals 3.
        /// </summary>
        public Image ReadImage(int view = 0, int channels = 4, Pixel type = Pixel.U8,
                               Output output = Output.Rgb, RasterizerState? state = null)
        {
            var image = new Image(width, height, channels, type);
            ReadImages(view, new[] { image }, output, state);
            return image;
        }

        /// <summary>Fill pictures of the caller with views, from number `first` on.</summary>
        public void ReadImages(int first, IReadOnlyList<Image> images, Output output = Output.Rgb,
                               RasterizerState? state = null)
        {
            using (var arena = new Arena())
            {
                splat_image[] natives = Image.ToNative(images, nameof(images), arena);
                Check.Ok(Native.splat_rasterizer_read_images(
                    Handle, Of(state), output, Check.Unsigned(first, nameof(first)),
                    (splat_image*)arena.Pin(natives), (uint)natives.Length));
            }
        }

        /// <summary>Compute gradients at the inputs of the state's last forward call.</summary>
        public void Backward(RasterGradients gradients, RasterizerState? state = null,
                             CancellationToken token = default(CancellationToken))
        {
            Check.NotNull(gradients, nameof(gradients));
            using (var arena = new Arena())
            {
                var desc = new splat_gradients_desc
                {
                    struct_size = (uint)sizeof(splat_gradients_desc),
                    flags = gradients.Flags,
                    grad_rgb = arena.Hold(gradients.Rgb),
                    grad_alpha = arena.Hold(gradients.Alpha),
                    grad_depth = arena.Hold(gradients.Depth),
                    grad_means = arena.Hold(gradients.Means),
                    grad_scales = arena.Hold(gradients.Scales),
                    grad_rotations = arena.Hold(gradients.Rotations),
                    grad_opacities = arena.Hold(gradients.Opacities),
                    grad_sh = arena.Hold(gradients.Sh),
                    grad_colors = arena.Hold(gradients.Colors),
                    grad_means2d = arena.Hold(gradients.Means2d),
                    grad_means2d_abs = arena.Hold(gradients.Means2dAbs),
                    grad_world_to_camera = arena.Hold(gradients.WorldToCamera),
                    grad_intrinsics = arena.Hold(gradients.Intrinsics),
                    contributions = arena.Hold(gradients.Contributions),
                };
                using (Cancellation.Of(device, token))
                    Check.Ok(Native.splat_rasterizer_backward(Handle, Of(state), &desc), token);
            }
        }

        internal override string About => width + " x " + height;

        /// <summary>Facts of the last forward call of the rasterizer's own state.</summary>
        public RasterizerInfo Info => GetInfo(null);

        /// <summary>Facts of the last forward call of a state; zeros before the first.</summary>
        public RasterizerInfo GetInfo(RasterizerState? state)
        {
            var info = new splat_rasterizer_info { struct_size = (uint)sizeof(splat_rasterizer_info) };
            Check.Ok(Native.splat_rasterizer_get_info(Handle, Of(state), &info));
            return new RasterizerInfo(&info);
        }

        private static SafeRasterStateHandle Of(RasterizerState? state) =>
            state == null ? SafeRasterStateHandle.Null : state.Handle;
    }
}
