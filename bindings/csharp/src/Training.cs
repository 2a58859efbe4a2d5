using System;
using System.Collections.Generic;
using Splat.Interop;

namespace Splat
{
    /// <summary>How to open a training.</summary>
    public sealed class TrainingOptions
    {
        /// <summary>YAML or JSON; null: the defaults, or that of the run that is resumed.</summary>
        public string Config { get; set; }
        /// <summary>Changes to it, "key=value".</summary>
        public IReadOnlyList<string> Values { get; set; }
        /// <summary>Null: the split train of data.root.</summary>
        public Dataset Dataset { get; set; }
        /// <summary>Null: none, or without Dataset the split val where there is one.</summary>
        public Dataset Validation { get; set; }
        /// <summary>File of weights to start from; null: by the configuration.</summary>
        public string Init { get; set; }
        /// <summary>How to load them.</summary>
        public LoadFlags InitFlags { get; set; }
        /// <summary>Resume, overwrite.</summary>
        public TrainingFlags Flags { get; set; }
    }

    /// <summary>A training as a run; enumerate it to train.</summary>
    public sealed unsafe class Training : RunBase
    {
        private readonly SafeDeviceHandle device;
        private readonly string folder;

        /// <summary>Open a run in a folder, which it makes or locks.</summary>
        public Training(Device device, string folder, TrainingOptions options = null)
            : base(Create(device, folder, options ?? new TrainingOptions()))
        {
            this.device = device.Handle;
            this.folder = folder;
        }

        private static SafeRunHandle Create(Device device, string folder, TrainingOptions options)
        {
            Check.NotNull(device, nameof(device));
            Check.NotNull(folder, nameof(folder));
            using (var arena = new Arena())
            {
                var desc = new splat_training_desc
                {
                    struct_size = (uint)sizeof(splat_training_desc),
                    flags = options.Flags,
                    folder = arena.Text(folder),
                    config = arena.Text(options.Config),
                    values = arena.Texts(options.Values, nameof(options.Values)),
                    value_count = (ulong)(options.Values?.Count ?? 0),
                    dataset = arena.Hold(options.Dataset),
                    validation = arena.Hold(options.Validation),
                    init = arena.Text(options.Init),
                    init_flags = options.InitFlags,
                };
                IntPtr handle;
                Check.Ok(Native.splat_training_open(device.Handle, &desc, &handle));
                return new SafeRunHandle(handle, true);
            }
        }

        internal override string About => folder;

        /// <summary>
        /// Facts of the latest step of this session, skipped or not. Throws before the first step.
        /// </summary>
        public TrainerInfo LastStep
        {
            get
            {
                var info = new splat_trainer_info
                    { struct_size = (uint)sizeof(splat_trainer_info) };
                Check.Ok(Native.splat_training_last_step(Handle, &info));
                return new TrainerInfo(&info);
            }
        }

        /// <summary>The network in training, a new object to be disposed.</summary>
        public Model GetModel()
        {
            IntPtr model;
            Check.Ok(Native.splat_training_model(Handle, &model));
            return new Model(model, device);
        }
    }
}
