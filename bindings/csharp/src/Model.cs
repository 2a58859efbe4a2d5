using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;
using System.Threading;
using Splat.Interop;

namespace Splat
{
    /// <summary>What a model is made for.</summary>
    public sealed class ModelOptions
    {
        /// <summary>JSON or YAML with the keys of Splatter Image; null: the cars model.</summary>
        public string? Config { get; set; }
        /// <summary>Objects of a batch; 0: 1.</summary>
        public int Objects { get; set; }
        /// <summary>Gradients, dropout, memory.</summary>
        public ModelFlags Flags { get; set; }
        /// <summary>Default: balanced.</summary>
        public Precision Precision { get; set; }
    }

    /// <summary>Arrays of a pass over N images; null: not given. See the model's configuration.</summary>
    public sealed class ModelInput
    {
        /// <summary>[N,channels,R,R]: RGB 0 to 1, depth, normal, mask, planes, origin distance.</summary>
        public ReadOnlyMemory<float> Images { get; set; }
        /// <summary>Instead of Images: N pictures, or a multiple whose planes join.</summary>
        public IReadOnlyList<Image>? Pictures { get; set; }
        /// <summary>[N,4,4] row vectors; null: the identity.</summary>
        public ReadOnlyMemory<float> ViewToWorld { get; set; }
        /// <summary>[N,4] w x y z of that rotation.</summary>
        public ReadOnlyMemory<float> Quaternions { get; set; }
        /// <summary>[N,2] pixels; null unless the configuration's fov is 0.</summary>
        public ReadOnlyMemory<float> Focals { get; set; }
        /// <summary>[N,length] of a custom embedding.</summary>
        public ReadOnlyMemory<float> Embedding { get; set; }
        /// <summary>[N,token_dim,tokens].</summary>
        public ReadOnlyMemory<float> Tokens { get; set; }
        /// <summary>Take what the model's tensors hold; the arrays are null.</summary>
        public PassFlags Flags { get; set; }
        /// <summary>Seed of dropout, used with Step.</summary>
        public long Seed { get; set; }
        /// <summary>The optimiser's step.</summary>
        public int Step { get; set; }
    }

    /// <summary>Gradients of a loss with respect to the outputs, in their shapes; null: zeros.</summary>
    public sealed class ModelGradients
    {
        /// <summary>[objects,M,3].</summary>
        public ReadOnlyMemory<float> Means { get; set; }
        /// <summary>[objects,M,1].</summary>
        public ReadOnlyMemory<float> Opacities { get; set; }
        /// <summary>[objects,M,3].</summary>
        public ReadOnlyMemory<float> Scales { get; set; }
        /// <summary>[objects,M,4].</summary>
        public ReadOnlyMemory<float> Rotations { get; set; }
        /// <summary>[objects,M,K,3].</summary>
        public ReadOnlyMemory<float> Sh { get; set; }
        /// <summary>Take what the model's tensors hold; the arrays are null.</summary>
        public PassFlags Flags { get; set; }
    }

    /// <summary>
    /// A network from images to Gaussians with its parameters on a device. The caller synchronises
    /// calls on one model.
    /// </summary>
    public sealed unsafe class Model : NativeObject<SafeModelHandle>
    {
        private readonly SafeDeviceHandle device;

        /// <summary>Create a model; its parameters are zero.</summary>
        public Model(Device device, ModelOptions? options = null)
            : base(Create(device, options ?? new ModelOptions()))
        {
            this.device = device.Handle;
        }

        internal Model(IntPtr handle, SafeDeviceHandle device)
            : base(new SafeModelHandle(handle, true))
        {
            this.device = device;
        }

        private static SafeModelHandle Create(Device device, ModelOptions options)
        {
            Check.NotNull(device, nameof(device));
            using (var arena = new Arena())
            {
                var desc = new splat_model_desc
                {
                    struct_size = (uint)sizeof(splat_model_desc),
                    flags = options.Flags,
                    config = arena.Optional(options.Config, nameof(options.Config)),
                    objects = Check.Unsigned(options.Objects, nameof(options.Objects)),
                    precision = options.Precision,
                };
                IntPtr handle;
                Check.Ok(Native.splat_model_create(device.Handle, &desc, &handle));
                return new SafeModelHandle(handle, true);
            }
        }

        /// <summary>Set the parameters at random, as published.</summary>
        public void Init(long seed) => Check.Ok(Native.splat_model_init(Handle, unchecked((ulong)seed)));

        /// <summary>Load the parameters of a state dict, all or none.</summary>
        public void Load(Weights weights, LoadFlags flags = LoadFlags.None)
        {
            Check.NotNull(weights, nameof(weights));
            Check.Ok(Native.splat_model_load(Handle, weights.Handle, flags));
        }

        /// <summary>The parameters as a state dict.</summary>
        public Weights Store() => new Weights(Check.Made(Handle, Native.splat_model_store));

        /// <summary>The parameters in another form: adapters alone, or folded in.</summary>
        public Weights Export(ModelExport what)
        {
            IntPtr weights;
            Check.Ok(Native.splat_model_export(Handle, what, &weights));
            return new Weights(weights);
        }

        /// <summary>JSON: parameters, memory, shapes, configuration.</summary>
        public string ReportJson() => Text.Get(Handle, Native.splat_model_report);

        /// <summary>What the model was made for, and what its latest pass gave.</summary>
        public ModelInfo Info
        {
            get
            {
                var info = new splat_model_info { struct_size = (uint)sizeof(splat_model_info) };
                Check.Ok(Native.splat_model_get_info(Handle, &info));
                return new ModelInfo(&info);
            }
        }

        internal override string About => Info.Resolution + " pixels, " + Info.Gaussians + " Gaussians";

        /// <summary>Inputs, outputs or parameters.</summary>
        public IReadOnlyList<Port> Ports(PortKind kind)
        {
            SafeModelHandle handle = Handle;
            return Port.List(this, (ports, capacity, count) =>
                Native.splat_model_ports(handle, kind, ports, capacity, count));
        }

        /// <summary>
        /// A tensor that shares the model's memory: an input, an output ("means", "means[1]"), a
        /// parameter, or a gradient ("grad:" and a name).
        /// </summary>
        public Tensor Tensor(string name)
        {
            using (var arena = new Arena())
            {
                IntPtr tensor;
                Check.Ok(Native.splat_model_tensor(Handle, arena.Text(name, nameof(name)), &tensor));
                return new Tensor(tensor);
            }
        }

        /// <summary>Run the network.</summary>
        public void Forward(ModelInput input, CancellationToken token = default(CancellationToken))
        {
            Check.NotNull(input, nameof(input));
            using (var arena = new Arena())
            {
                splat_image[]? pictures = input.Pictures == null
                    ? null : Image.ToNative(input.Pictures, nameof(input.Pictures), arena);
                var native = new splat_model_input
                {
                    struct_size = (uint)sizeof(splat_model_input),
                    flags = input.Flags,
                    seed = unchecked((ulong)input.Seed),
                    step = Check.Unsigned(input.Step, nameof(input.Step)),
                    picture_count = (uint)(pictures?.Length ?? 0),
                    pictures = (splat_image*)arena.Pin(pictures),
                    images = (float*)arena.Pin(input.Images),
                    images_count = Count(input.Images, nameof(input.Images)),
                    view_to_world = (float*)arena.Pin(input.ViewToWorld),
                    view_to_world_count = Count(input.ViewToWorld, nameof(input.ViewToWorld)),
                    quaternions = (float*)arena.Pin(input.Quaternions),
                    quaternions_count = Count(input.Quaternions, nameof(input.Quaternions)),
                    focals = (float*)arena.Pin(input.Focals),
                    focals_count = Count(input.Focals, nameof(input.Focals)),
                    embedding = (float*)arena.Pin(input.Embedding),
                    embedding_count = Count(input.Embedding, nameof(input.Embedding)),
                    tokens = (float*)arena.Pin(input.Tokens),
                    tokens_count = Count(input.Tokens, nameof(input.Tokens)),
                };
                using (Cancellation.Of(device, token))
                    Check.Ok(Native.splat_model_forward(Handle, &native), token);
            }
        }

        /// <summary>Add the gradients of a loss to those of the parameters.</summary>
        public void Backward(ModelGradients gradients,
                             CancellationToken token = default(CancellationToken))
        {
            Check.NotNull(gradients, nameof(gradients));
            using (var arena = new Arena())
            {
                var native = new splat_model_gradients
                {
                    struct_size = (uint)sizeof(splat_model_gradients),
                    flags = gradients.Flags,
                    means = (float*)arena.Pin(gradients.Means),
                    means_count = Count(gradients.Means, nameof(gradients.Means)),
                    opacities = (float*)arena.Pin(gradients.Opacities),
                    opacities_count = Count(gradients.Opacities, nameof(gradients.Opacities)),
                    scales = (float*)arena.Pin(gradients.Scales),
                    scales_count = Count(gradients.Scales, nameof(gradients.Scales)),
                    rotations = (float*)arena.Pin(gradients.Rotations),
                    rotations_count = Count(gradients.Rotations, nameof(gradients.Rotations)),
                    sh = (float*)arena.Pin(gradients.Sh),
                    sh_count = Count(gradients.Sh, nameof(gradients.Sh)),
                };
                using (Cancellation.Of(device, token))
                    Check.Ok(Native.splat_model_backward(Handle, &native), token);
            }
        }

        /// <summary>
        /// Numbers of an array. A count of 0 means "trusted" to the library, so an empty array is
        /// refused here.
        /// </summary>
        internal static ulong Count<T>(ReadOnlyMemory<T> values, string name)
        {
            if (values.Length == 0 && !values.Equals(default(ReadOnlyMemory<T>)))
                throw new ArgumentException("an empty array; null means that it is not given", name);
            return (ulong)values.Length;
        }

        /// <summary>Set the gradients of all parameters to zero.</summary>
        public void ZeroGradients() => Check.Ok(Native.splat_model_zero_gradients(Handle));

        /// <summary>Copy a tensor of the latest pass into memory of the caller.</summary>
        public void Read(string name, Span<float> values) =>
            Values.Move(Handle, name, values, Native.splat_model_read);

        /// <summary>The same in a new array.</summary>
        public float[] Read(string name)
        {
            using (Tensor tensor = Tensor(name))
            {
                float[] values = Values.New<float>(name, tensor.Info.Elements);
                Read(name, values);
                return values;
            }
        }

        /// <summary>Set a parameter, by the name of the state dict.</summary>
        public void Write(string name, ReadOnlySpan<float> values) =>
            Values.Move(Handle, name, values, Native.splat_model_write);

        /// <summary>The Gaussians of one object as a new scene.</summary>
        public Scene ToScene(int objectIndex = 0)
        {
            IntPtr scene;
            Check.Ok(Native.splat_model_scene(
                Handle, Check.Unsigned(objectIndex, nameof(objectIndex)), &scene));
            return new Scene(scene);
        }
    }
}
