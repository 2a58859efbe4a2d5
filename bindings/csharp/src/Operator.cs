using System;
using System.Collections.Generic;
using System.Threading;
using Splat.Interop;

namespace Splat
{
    /// <summary>The type, attributes and tensors of an operator.</summary>
    public sealed class OperatorOptions
    {
        /// <summary>A name of Operator.ListJson.</summary>
        public string Type { get; set; }
        /// <summary>JSON object; null: defaults.</summary>
        public string Attributes { get; set; }
        /// <summary>OpFlags.Accumulate: gradients of parameters add up.</summary>
        public OpFlags Flags { get; set; }
        /// <summary>In the operator's order; an optional one may be null.</summary>
        public IReadOnlyList<Tensor> Inputs { get; set; }
        /// <summary>In the operator's order; an optional one may be null.</summary>
        public IReadOnlyList<Tensor> Outputs { get; set; }
        /// <summary>One per output; null: no backward.</summary>
        public IReadOnlyList<Tensor> GradOutputs { get; set; }
        /// <summary>One per input; gradients of null entries are not computed.</summary>
        public IReadOnlyList<Tensor> GradInputs { get; set; }
    }

    /// <summary>A single differentiable operator on given tensors. Thread-safe.</summary>
    public sealed unsafe class Operator : NativeObject<SafeOpHandle>
    {
        private readonly SafeDeviceHandle device;
        private readonly string type;

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

        internal override string About => type;

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
