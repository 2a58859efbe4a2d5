using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;
using Splat.Interop;

namespace Splat
{
    /// <summary>What an optimizer updates: a model, a module, or one tensor.</summary>
    public sealed class OptimizerItem
    {
        /// <summary>A model with gradients; `prefix` goes before its names.</summary>
        public OptimizerItem(Model model, string? prefix = null)
        {
            Model = Check.NotNull(model, nameof(model));
            Name = prefix;
        }

        /// <summary>A module with gradients; `prefix` goes before its names.</summary>
        public OptimizerItem(Module module, string? prefix = null)
        {
            Module = Check.NotNull(module, nameof(module));
            Name = prefix;
        }

        /// <summary>A float tensor and its gradient, of one shape.</summary>
        public OptimizerItem(string name, Tensor parameter, Tensor gradient)
        {
            Name = Check.NotNull(name, nameof(name));
            Parameter = Check.NotNull(parameter, nameof(parameter));
            Gradient = Check.NotNull(gradient, nameof(gradient));
        }

        internal string? Name { get; }
        internal Model? Model { get; }
        internal Module? Module { get; }
        internal Tensor? Parameter { get; }
        internal Tensor? Gradient { get; }
    }

    /// <summary>Parameters with numbers of their own; 0: those of the options.</summary>
    public sealed class OptimizerGroup
    {
        /// <summary>Names: '*' is any text, '?' one character.</summary>
        public string? Pattern { get; set; }
        /// <summary>Multiplies the rate; 0: 1.</summary>
        public double RateFactor { get; set; }
        /// <summary>Adam's beta1.</summary>
        public double Beta1 { get; set; }
        /// <summary>Adam's beta2.</summary>
        public double Beta2 { get; set; }
        /// <summary>Adam's epsilon.</summary>
        public double Eps { get; set; }
    }

    /// <summary>Numbers of Adam, of its schedule and of averaged weights; 0: the default.</summary>
    public sealed class OptimizerOptions
    {
        /// <summary>A parameter belongs to the first group that matches its name.</summary>
        public IReadOnlyList<OptimizerGroup>? Groups { get; set; }
        /// <summary>0: 5e-5.</summary>
        public double Rate { get; set; }
        /// <summary>0: 0.9.</summary>
        public double Beta1 { get; set; }
        /// <summary>0: 0.999.</summary>
        public double Beta2 { get; set; }
        /// <summary>0: 1e-15.</summary>
        public double Eps { get; set; }
        /// <summary>Default: constant.</summary>
        public Schedule Schedule { get; set; }
        /// <summary>Steps in which the rate rises from zero.</summary>
        public long WarmupSteps { get; set; }
        /// <summary>End of Schedule.Cosine.</summary>
        public long TotalSteps { get; set; }
        /// <summary>Step at which Schedule.Step lowers the rate.</summary>
        public long StepAt { get; set; }
        /// <summary>Decay of averaged weights; 0: none.</summary>
        public double EmaDecay { get; set; }
        /// <summary>Steps between updates of the averages; 0: every step.</summary>
        public long EmaEvery { get; set; }
        /// <summary>Step up to which the averages are copies.</summary>
        public long EmaAfter { get; set; }
    }

    /// <summary>
    /// Adam over parameters of models, modules and tensors. The caller synchronises calls on one
    /// optimizer and on what it updates.
    /// </summary>
    public sealed unsafe class Optimizer : NativeObject<SafeOptimizerHandle>
    {
        /// <summary>Create an optimizer; it keeps what it updates alive.</summary>
        public Optimizer(Device device, IReadOnlyList<OptimizerItem> items,
                         OptimizerOptions? options = null)
            : base(Create(device, items, options ?? new OptimizerOptions()))
        {
        }

        private static SafeOptimizerHandle Create(Device device, IReadOnlyList<OptimizerItem> items,
                                              OptimizerOptions options)
        {
            Check.NotNull(device, nameof(device));
            Check.NotNull(items, nameof(items));
            using (var arena = new Arena())
            {
                splat_optimizer_item[] parts = Items(items, arena);
                splat_optimizer_group[] groups = Groups(options.Groups ?? Array.Empty<OptimizerGroup>(), arena);
                var desc = new splat_optimizer_desc
                {
                    struct_size = (uint)sizeof(splat_optimizer_desc),
                    items = (splat_optimizer_item*)arena.Pin(parts),
                    item_count = (ulong)parts.Length,
                    groups = (splat_optimizer_group*)arena.Pin(groups),
                    group_count = (ulong)groups.Length,
                    rate = options.Rate,
                    beta1 = options.Beta1,
                    beta2 = options.Beta2,
                    eps = options.Eps,
                    schedule = options.Schedule,
                    warmup_steps = Check.Unsigned(options.WarmupSteps, nameof(options.WarmupSteps)),
                    total_steps = Check.Unsigned(options.TotalSteps, nameof(options.TotalSteps)),
                    step_at = Check.Unsigned(options.StepAt, nameof(options.StepAt)),
                    ema_decay = options.EmaDecay,
                    ema_every = Check.Unsigned(options.EmaEvery, nameof(options.EmaEvery)),
                    ema_after = Check.Unsigned(options.EmaAfter, nameof(options.EmaAfter)),
                };
                IntPtr handle;
                Check.Ok(Native.splat_optimizer_create(device.Handle, &desc, &handle));
                return new SafeOptimizerHandle(handle, true);
            }
        }

        private static splat_optimizer_item[] Items(IReadOnlyList<OptimizerItem> items, Arena arena)
        {
            var natives = new splat_optimizer_item[items.Count];
            for (int i = 0; i < natives.Length; ++i)
            {
                OptimizerItem item = Check.NotNull(items[i], "items[" + i + "]");
                natives[i].name = arena.Optional(item.Name, nameof(item.Name));
                natives[i].model = arena.Hold(item.Model);
                natives[i].module = arena.Hold(item.Module);
                natives[i].parameter = arena.Hold(item.Parameter);
                natives[i].gradient = arena.Hold(item.Gradient);
            }
            return natives;
        }

        private static splat_optimizer_group[] Groups(IReadOnlyList<OptimizerGroup> groups, Arena arena)
        {
            var natives = new splat_optimizer_group[groups.Count];
            for (int i = 0; i < natives.Length; ++i)
            {
                OptimizerGroup group = Check.NotNull(groups[i], "Groups[" + i + "]");
                natives[i].pattern = arena.Optional(group.Pattern, nameof(group.Pattern));
                natives[i].rate_factor = group.RateFactor;
                natives[i].beta1 = group.Beta1;
                natives[i].beta2 = group.Beta2;
                natives[i].eps = group.Eps;
            }
            return natives;
        }

        /// <summary>
        /// Update the parameters from their gradients, which stay. Gradients that are not finite
        /// update nothing: see OptimizerInfo.WasSkipped.
        /// </summary>
        public OptimizerInfo Step()
        {
            var info = new splat_optimizer_info { struct_size = (uint)sizeof(splat_optimizer_info) };
            Check.Ok(Native.splat_optimizer_step(Handle, &info));
            return new OptimizerInfo(&info);
        }

        internal override string About => "step " + Info.Step + " of " + Info.Elements + " numbers";

        /// <summary>Set all gradients to zero.</summary>
        public void ZeroGradients() => Check.Ok(Native.splat_optimizer_zero_gradients(Handle));

        /// <summary>
        /// Reorder, drop and add rows of the tensors whose names have a pattern, with their moments
        /// and averages: row i becomes row rows[i]; -1: a new row, as it lies in the tensor.
        /// </summary>
        public void GatherRows(string pattern, ReadOnlySpan<long> rows)
        {
            using (var arena = new Arena())
            {
                byte* text = arena.Text(pattern, nameof(pattern));
                fixed (long* from = &MemoryMarshal.GetReference(rows))
                    Check.Ok(Native.splat_optimizer_gather_rows(Handle, text, from, (ulong)rows.Length));
            }
        }

        /// <summary>Replace the rate, which schedule and groups scale.</summary>
        public void SetRate(double rate) => Check.Ok(Native.splat_optimizer_set_rate(Handle, rate));

        /// <summary>Facts of the optimizer and its last step.</summary>
        public OptimizerInfo Info
        {
            get
            {
                var info = new splat_optimizer_info { struct_size = (uint)sizeof(splat_optimizer_info) };
                Check.Ok(Native.splat_optimizer_get_info(Handle, &info));
                return new OptimizerInfo(&info);
            }
        }

        /// <summary>The averaged parameters by name; without averages the parameters.</summary>
        public Weights Store() => new Weights(Check.Made(Handle, Native.splat_optimizer_store));

        /// <summary>Moments, averages, counters and rate, without the parameters.</summary>
        public Weights Save() => new Weights(Check.Made(Handle, Native.splat_optimizer_save));

        /// <summary>Go on from such a state, bit-exactly.</summary>
        public void Load(Weights state)
        {
            Check.NotNull(state, nameof(state));
            Check.Ok(Native.splat_optimizer_load(Handle, state.Handle));
        }
    }
}
