using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;
using System.Threading;
using Splat.Interop;

namespace Splat
{
    /// <summary>Type, attributes and shapes of a module.</summary>
    public sealed class ModuleOptions
    {
        /// <summary>A name of Operator.ListJson, or "residual_block".</summary>
        public string? Type { get; set; }
        /// <summary>JSON object; null: defaults.</summary>
        public string? Attributes { get; set; }
        /// <summary>Shapes of inputs and parameters by name.</summary>
        public IReadOnlyList<Port>? Ports { get; set; }
        /// <summary>Gradients, dropout.</summary>
        public ModuleFlags Flags { get; set; }
        /// <summary>Only for residual_block.</summary>
        public Precision Precision { get; set; }
    }

    /// <summary>
    /// One operator or one block of the network with its parameters. The caller synchronises calls
    /// on one module.
    /// </summary>
    public sealed unsafe class Module : NativeObject<SafeModuleHandle>
    {
        private readonly SafeDeviceHandle device;
        private readonly string? type;

        /// <summary>Create a module; its parameters, inputs and gradients of outputs are zero.</summary>
        public Module(Device device, ModuleOptions options)
            : base(Create(device, Check.NotNull(options, nameof(options))))
        {
            this.device = device.Handle;
            type = options.Type;
        }

        private static SafeModuleHandle Create(Device device, ModuleOptions options)
        {
            Check.NotNull(device, nameof(device));
            using (var arena = new Arena())
            {
                splat_port[] ports = Port.ToNative(options.Ports ?? Array.Empty<Port>(), arena);
                var desc = new splat_module_desc
                {
                    struct_size = (uint)sizeof(splat_module_desc),
                    flags = options.Flags,
                    type = arena.Optional(options.Type, nameof(options.Type)),
                    attributes = arena.Optional(options.Attributes, nameof(options.Attributes)),
                    ports = (splat_port*)arena.Pin(ports),
                    port_count = (uint)ports.Length,
                    precision = options.Precision,
                };
                IntPtr handle;
                Check.Ok(Native.splat_module_create(device.Handle, &desc, &handle));
                return new SafeModuleHandle(handle, true);
            }
        }

        /// <summary>Set the parameters at random, as published.</summary>
        public void Init(long seed) => Check.Ok(Native.splat_module_init(Handle, unchecked((ulong)seed)));

        /// <summary>JSON: inputs, outputs and parameters with shapes.</summary>
        public string ReportJson() => Text.Get(Handle, Native.splat_module_report);

        internal override string About => type ?? "";

        /// <summary>Inputs, outputs or parameters.</summary>
        public IReadOnlyList<Port> Ports(PortKind kind)
        {
            SafeModuleHandle handle = Handle;
            return Port.List(this, (ports, capacity, count) =>
                Native.splat_module_ports(handle, kind, ports, capacity, count));
        }

        /// <summary>Write an input, a parameter, or the gradient of an output ("grad:y").</summary>
        public void Write(string name, ReadOnlySpan<float> values) =>
            Values.Move(Handle, name, values, Native.splat_module_write);

        /// <summary>Read what Write writes, an output, or a gradient, into memory of the caller.</summary>
        public void Read(string name, Span<float> values) =>
            Values.Move(Handle, name, values, Native.splat_module_read);

        /// <summary>The same in a new array.</summary>
        public float[] Read(string name)
        {
            Check.NotNull(name, nameof(name));
            string bare = name.StartsWith("grad:", StringComparison.Ordinal) ? name.Substring(5)
                : name;
            long count = 0;
            foreach (PortKind kind in new[] { PortKind.Input, PortKind.Output, PortKind.Parameter })
                foreach (Port port in Ports(kind))
                    if (port.Name == bare) count = port.Elements;
            float[] values = Values.New<float>(name, count);
            Read(name, values);
            return values;
        }

        /// <summary>Compute the outputs.</summary>
        public void Forward(CancellationToken token = default(CancellationToken))
        {
            using (Cancellation.Of(device, token))
                Check.Ok(Native.splat_module_forward(Handle), token);
        }

        /// <summary>Add to the gradients of parameters and overwrite those of inputs.</summary>
        public void Backward(CancellationToken token = default(CancellationToken))
        {
            using (Cancellation.Of(device, token))
                Check.Ok(Native.splat_module_backward(Handle), token);
        }

        /// <summary>Set the gradients of parameters to zero.</summary>
        public void ZeroGradients() => Check.Ok(Native.splat_module_zero_gradients(Handle));
    }

    /// <summary>A named tensor of a model or a module.</summary>
    public sealed unsafe class Port : Facts<Port>
    {
        /// <summary>Describe a port, for ModuleOptions.</summary>
        public Port(string name, params long[] dims)
        {
            Name = Check.NotNull(name, nameof(name));
            Dims = Check.Dims(dims, nameof(dims));
        }

        private Port(splat_port* native)
        {
            Name = Text.Read(native->name, -1);
            Flags = native->flags;
            Dims = Values.List<long>(native->dims, (int)native->rank);
        }

        /// <summary>Name of the port.</summary>
        public string Name { get; }
        /// <summary>Optional, trainable, with a gradient.</summary>
        public PortFlags Flags { get; }
        /// <summary>Shape, outermost first.</summary>
        public IReadOnlyList<long> Dims { get; }

        /// <summary>Number of elements.</summary>
        public long Elements
        {
            get
            {
                long count = 1;
                foreach (long dim in Dims) count *= dim;
                return count;
            }
        }

        internal delegate ResultCode ListCall(splat_port* ports, uint capacity, uint* count);

        /// <summary>
        /// All ports of a list. Their names live as long as the owner, which is kept meanwhile.
        /// </summary>
        internal static Port[] List<T>(NativeObject<T> owner, ListCall call) where T : SafeHandle
        {
            using (var arena = new Arena())
            {
                arena.Hold(owner);
                uint count;
                Check.Ok(call(null, 0, &count));
                var natives = new splat_port[count];
                var ports = new Port[count];
                fixed (splat_port* first = natives)
                {
                    Check.Ok(call(first, count, &count));
                    for (int i = 0; i < ports.Length; ++i) ports[i] = new Port(first + i);
                }
                return ports;
            }
        }

        internal static splat_port[] ToNative(IReadOnlyList<Port> ports, Arena arena)
        {
            var natives = new splat_port[ports.Count];
            for (int i = 0; i < natives.Length; ++i)
            {
                Port port = Check.NotNull(ports[i], "ports[" + i + "]");
                natives[i].name = arena.Text(port.Name, nameof(port.Name));
                natives[i].rank = (uint)port.Dims.Count;
                fixed (long* dims = natives[i].dims)
                    for (int k = 0; k < port.Dims.Count; ++k) dims[k] = port.Dims[k];
            }
            return natives;
        }
    }

    /// <summary>The type, attributes and tensors of an operator.</summary>
    public sealed class OperatorOptions
    {
        /// <summary>A name of Operator.ListJson.</summary>
        public string? Type { get; set; }
        /// <summary>JSON object; null: defaults.</summary>
        public string? Attributes { get; set; }
        /// <summary>OpFlags.Accumulate: gradients of parameters add up.</summary>
        public OpFlags Flags { get; set; }
        /// <summary>In the operator's order; an optional one may be null.</summary>
        public IReadOnlyList<Tensor>? Inputs { get; set; }
        /// <summary>In the operator's order; an optional one may be null.</summary>
        public IReadOnlyList<Tensor>? Outputs { get; set; }
        /// <summary>One per output; null: no backward.</summary>
        public IReadOnlyList<Tensor>? GradOutputs { get; set; }
        /// <summary>One per input; gradients of null entries are not computed.</summary>
        public IReadOnlyList<Tensor>? GradInputs { get; set; }
    }

    /// <summary>A single differentiable operator on given tensors. Thread-safe.</summary>
    public sealed unsafe class Operator : NativeObject<SafeOpHandle>
    {
        private readonly SafeDeviceHandle device;
        private readonly string? type;

        /// <summary>Record an operator; the contents of its tensors may change between runs.</summary>
        public Operator(Device device, OperatorOptions options)
            : base(Create(device, Check.NotNull(options, nameof(options))))
        {
            this.device = device.Handle;
            type = options.Type;
        }

        private static SafeOpHandle Create(Device device, OperatorOptions options)
        {
            Check.NotNull(device, nameof(device));
            int inputs = options.Inputs?.Count ?? 0;
            int outputs = options.Outputs?.Count ?? 0;
            if (options.GradOutputs != null && options.GradOutputs.Count != outputs)
                throw new ArgumentException(options.GradOutputs.Count + " GradOutputs for " + outputs +
                                            " outputs", nameof(options));
            if (options.GradInputs != null && options.GradInputs.Count != inputs)
                throw new ArgumentException(options.GradInputs.Count + " GradInputs for " + inputs +
                                            " inputs", nameof(options));
            using (var arena = new Arena())
            {
                var desc = new splat_op_desc
                {
                    struct_size = (uint)sizeof(splat_op_desc),
                    flags = options.Flags,
                    type = arena.Optional(options.Type, nameof(options.Type)),
                    attributes = arena.Optional(options.Attributes, nameof(options.Attributes)),
                    input_count = (uint)inputs,
                    output_count = (uint)outputs,
                    inputs = arena.HoldAll(options.Inputs),
                    outputs = arena.HoldAll(options.Outputs),
                    grad_outputs = arena.HoldAll(options.GradOutputs),
                    grad_inputs = arena.HoldAll(options.GradInputs),
                };
                IntPtr handle;
                Check.Ok(Native.splat_op_create(device.Handle, &desc, &handle));
                return new SafeOpHandle(handle, true);
            }
        }

        internal override string About => type ?? "";

        /// <summary>JSON array of all operators with their tensors and attributes.</summary>
        public static string ListJson() => Text.Get(Native.splat_op_list);

        /// <summary>Compute the outputs from the inputs.</summary>
        public void Forward(CancellationToken token = default(CancellationToken))
        {
            using (Cancellation.Of(device, token))
                Check.Ok(Native.splat_op_forward(Handle), token);
        }

        /// <summary>Compute the gradients at the activations of the last forward.</summary>
        public void Backward(CancellationToken token = default(CancellationToken))
        {
            using (Cancellation.Of(device, token))
                Check.Ok(Native.splat_op_backward(Handle), token);
        }
    }
}
