using System;
using System.Collections;
using System.Collections.Generic;
using System.Threading;
using System.Threading.Tasks;
using Splat.Interop;

namespace Splat
{
    /// <summary>What one piece of work of a run did.</summary>
    public sealed unsafe class RunEvent
    {
        private readonly RunBase run;
        private readonly long serial;
        private readonly float* images;
        private readonly float* truths;
        private readonly int count;

        internal RunEvent(RunBase run, long serial, splat_run_event* from)
        {
            this.run = run;
            this.serial = serial;
            images = from->images;
            truths = from->truths;
            count = checked((int)from->image_count);
            Kind = from->kind;
            Message = Text.Optional(from->text);
            IsWarning = from->warning != 0;
            IsUpdate = from->updated != 0;
            IsLogged = from->logged != 0;
            Step = checked((long)from->step);
            Attempts = checked((long)from->attempts);
            Iterations = checked((long)from->iterations);
            Skipped = checked((long)from->skipped);
            PeakBytes = checked((long)from->peak_bytes);
            Seconds = from->seconds;
            StepsPerSecond = from->steps_per_second;
            var numbers = new Dictionary<string, double>();
            for (ulong i = 0; i < from->number_count; ++i)
                numbers[Text.Read(from->numbers[i].name, -1)] = from->numbers[i].value;
            Numbers = numbers;
            Name = Text.Optional(from->name);
            Piece = checked((int)from->piece);
            Pieces = checked((int)from->pieces);
            Views = checked((int)from->views);
            Inputs = checked((int)from->inputs);
            Width = checked((int)from->width);
            Height = checked((int)from->height);
        }

        /// <summary>Step, validation, checkpoint, or what ended the run.</summary>
        public RunEventKind Kind { get; }
        /// <summary>The line of log.txt; null: none.</summary>
        public string? Message { get; }
        /// <summary>The message warns.</summary>
        public bool IsWarning { get; }
        /// <summary>A step updated what is learned.</summary>
        public bool IsUpdate { get; }
        /// <summary>metrics.jsonl got a line of the step.</summary>
        public bool IsLogged { get; }
        /// <summary>Updates done.</summary>
        public long Step { get; }
        /// <summary>Steps tried.</summary>
        public long Attempts { get; }
        /// <summary>Updates of the whole run.</summary>
        public long Iterations { get; }
        /// <summary>Attempts that updated nothing.</summary>
        public long Skipped { get; }
        /// <summary>Most device memory so far.</summary>
        public long PeakBytes { get; }
        /// <summary>Since the first step of this session.</summary>
        public double Seconds { get; }
        /// <summary>Speed of the latest steps.</summary>
        public double StepsPerSecond { get; }
        /// <summary>By their names in metrics.jsonl, such as "loss", "psnr" and "val_psnr".</summary>
        public IReadOnlyDictionary<string, double> Numbers { get; }
        /// <summary>Name of the validated piece, else null.</summary>
        public string? Name { get; }
        /// <summary>Number of the validated piece.</summary>
        public int Piece { get; }
        /// <summary>Pieces of the validation.</summary>
        public int Pieces { get; }
        /// <summary>Views of the piece, the input views first.</summary>
        public int Views { get; }
        /// <summary>Input views among them.</summary>
        public int Inputs { get; }
        /// <summary>Pixels of an image.</summary>
        public int Width { get; }
        /// <summary>Pixels of an image.</summary>
        public int Height { get; }

        /// <summary>True for the last event of a run.</summary>
        public bool IsEnd => Kind >= RunEventKind.Done;

        /// <summary>Kind, step and message.</summary>
        public override string ToString() => Kind + " at step " + Step + (Message == null ? "" : ": " + Message);

        /// <summary>
        /// Copy of the drawn images [views,3,height,width] of a validated piece; empty for other
        /// events. Throws InvalidOperationException once the run has gone on.
        /// </summary>
        public float[] ReadImages() => run.Copy(serial, images, count);

        /// <summary>Copy of the true images, see ReadImages.</summary>
        public float[] ReadTruths() => run.Copy(serial, truths, count);
    }

    /// <summary>
    /// A task with its folder, such as Training or Fit; enumerate it to do all of it. The last event is the
    /// one whose IsEnd is true. The caller synchronises calls on one run, except Interrupt and
    /// Dispose.
    /// </summary>
    public abstract unsafe class RunBase : NativeObject<SafeRunHandle>, IEnumerable<RunEvent>
    {
        private long serial;

        internal RunBase(SafeRunHandle handle) : base(handle)
        {
        }

        /// <summary>Do the next piece of work. After an error the next call tries it again.</summary>
        public RunEvent Next()
        {
            SafeRunHandle handle = Handle;
            using (var arena = new Arena())
            {
                arena.Hold(this);  // the event's texts live as long as the run
                ++serial;
                var native = new splat_run_event { struct_size = (uint)sizeof(splat_run_event) };
                ResultCode code = Native.splat_run_next(handle, &native);
                if (code < 0) Rethrow();
                Check.Ok(code);
                return new RunEvent(this, serial, &native);
            }
        }

        /// <summary>Throw what a function of the caller threw in a call that failed, if one did.</summary>
        internal virtual void Rethrow()
        {
        }

        /// <summary>
        /// Run to the end. A token that is cancelled interrupts the run: the state is saved, the
        /// last event is RunEventKind.Interrupted, and the run can be resumed.
        /// </summary>
        public IEnumerable<RunEvent> Run(CancellationToken token)
        {
            using (token.Register(InterruptQuietly))
            {
                RunEvent last;
                do
                {
                    last = Next();
                    yield return last;
                } while (!last.IsEnd);
            }
        }

        /// <summary>
        /// Run to the end on another thread and give the last event. A token that is cancelled interrupts the run, as
        /// that of Run does: the task ends well, with RunEventKind.Interrupted. ReadImages of an event works where
        /// `progress` is called at once, and not in a Progress, which calls later.
        /// </summary>
        public Task<RunEvent> RunAsync(IProgress<RunEvent>? progress = null,
                                       CancellationToken token = default(CancellationToken)) =>
            Task.Run(() =>
            {
                using (token.Register(InterruptQuietly))
                {
                    while (true)
                    {
                        RunEvent next = Next();
                        progress?.Report(next);
                        if (next.IsEnd) return next;
                    }
                }
            });

        /// <summary>Run to the end, one event after the other.</summary>
        public IEnumerator<RunEvent> GetEnumerator() => Run(CancellationToken.None).GetEnumerator();

        IEnumerator IEnumerable.GetEnumerator()
        {
            return GetEnumerator();
        }

        /// <summary>
        /// End the run: the next piece of work saves the state and is RunEventKind.Interrupted. Any
        /// thread may call it.
        /// </summary>
        public void Interrupt() => Check.Ok(Native.splat_run_interrupt(Handle));

        // A run that is disposed meanwhile needs no interruption.
        private void InterruptQuietly()
        {
            try
            {
                Interrupt();
            }
            catch (ObjectDisposedException)
            {
            }
        }

        /// <summary>JSON: folder, step, loss, best validation.</summary>
        public string ReportJson() => Text.Get(Handle, Native.splat_run_report);

        internal float[] Copy(long ofEvent, float* from, int count)
        {
            using (var arena = new Arena())
            {
                arena.Hold(this);
                if (ofEvent != serial)
                    throw new InvalidOperationException(
                        "The run has gone on; read the images of an event before the next one.");
                return from == null ? Array.Empty<float>() : Values.Copy(from, count);
            }
        }
    }

    /// <summary>How to open a training.</summary>
    public sealed class TrainingOptions
    {
        /// <summary>YAML or JSON; null: the defaults, or that of the run that is resumed.</summary>
        public string? Config { get; set; }
        /// <summary>Changes to it, "key=value".</summary>
        public IReadOnlyList<string>? Values { get; set; }
        /// <summary>Null: the split train of data.root.</summary>
        public Dataset? Dataset { get; set; }
        /// <summary>Null: none, or without Dataset the split val where there is one.</summary>
        public Dataset? Validation { get; set; }
        /// <summary>File of weights to start from; null: by the configuration.</summary>
        public string? Init { get; set; }
        /// <summary>How to load them.</summary>
        public LoadFlags InitFlags { get; set; }
        /// <summary>Resume, overwrite.</summary>
        public TrainingFlags Flags { get; set; }
        /// <summary>
        /// The ranks that train together, each on a device of its own: all open the training with equal data,
        /// configuration and Init, and take its events; null: there are no others.
        /// </summary>
        public Ranks? Ranks { get; set; }
    }

    /// <summary>A training as a run; enumerate it to train.</summary>
    public sealed unsafe class Training : RunBase
    {
        private readonly SafeDeviceHandle device;
        private readonly string folder;
        private readonly Ranks? ranks;

        /// <summary>Open a run in a folder, which it makes or locks.</summary>
        public Training(Device device, string folder, TrainingOptions? options = null)
            : base(Create(device, folder, options ?? new TrainingOptions()))
        {
            this.device = device.Handle;
            this.folder = folder;
            ranks = options?.Ranks;
        }

        internal override void Rethrow() => ranks?.Rethrow();

        /// <summary>Release the run, which may tell other ranks.</summary>
        protected override void Dispose(bool disposing)
        {
            base.Dispose(disposing);
            GC.KeepAlive(ranks);
        }

        private static SafeRunHandle Create(Device device, string folder, TrainingOptions options)
        {
            Check.NotNull(device, nameof(device));
            using (var arena = new Arena())
            {
                var desc = new splat_training_desc
                {
                    struct_size = (uint)sizeof(splat_training_desc),
                    flags = options.Flags,
                    folder = arena.Text(folder, nameof(folder)),
                    config = arena.Optional(options.Config, nameof(options.Config)),
                    values = arena.Texts(options.Values, nameof(options.Values)),
                    value_count = (ulong)(options.Values?.Count ?? 0),
                    dataset = arena.Hold(options.Dataset),
                    validation = arena.Hold(options.Validation),
                    init = arena.Optional(options.Init, nameof(options.Init)),
                    init_flags = options.InitFlags,
                };
                splat_group group = options.Ranks?.Group() ?? default(splat_group);
                if (options.Ranks != null) desc.group = &group;
                IntPtr handle;
                ResultCode code = Native.splat_training_open(device.Handle, &desc, &handle);
                if (code < 0) options.Ranks?.Rethrow();
                Check.Ok(code);
                GC.KeepAlive(options.Ranks);
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
                var info = new splat_trainer_info { struct_size = (uint)sizeof(splat_trainer_info) };
                Check.Ok(Native.splat_training_last_step(Handle, &info));
                return new TrainerInfo(&info);
            }
        }

        /// <summary>The network in training, a new object to be disposed.</summary>
        public Model GetModel() => new Model(Check.Made(Handle, Native.splat_training_model), device);
    }

    /// <summary>How to fit a scene.</summary>
    public sealed class FitOptions
    {
        /// <summary>0: as many as Seconds take.</summary>
        public long Steps { get; set; }
        /// <summary>About how long to optimise on this device; 0: 60. Either this or Steps.</summary>
        public double Seconds { get; set; }
        /// <summary>Chooses the first Gaussians and the order of the photographs.</summary>
        public long Seed { get; set; }
        /// <summary>0: by the length of the fit.</summary>
        public long MaxGaussians { get; set; }
        /// <summary>Degree of the spherical harmonics, 0 to 3; null: 3.</summary>
        public int? ShDegree { get; set; }
        /// <summary>The sides of the photographs are divided by it; 0: 1.</summary>
        public int Downscale { get; set; }
        /// <summary>
        /// Each so many photographs by name, with the first, are held out for scores; null: 8;
        /// 0: all are fitted.
        /// </summary>
        public int? TestEvery { get; set; }
        /// <summary>Which file of cameras to read.</summary>
        public FitCameras Cameras { get; set; }
        /// <summary>Folder of masks, named like the photographs, 0 leaves out; null: none.</summary>
        public string? Masks { get; set; }
        /// <summary>Folder of depth maps, named like the photographs; null: none.</summary>
        public string? Depth { get; set; }
        /// <summary>Folder of maps of normals, named like the photographs; null: none.</summary>
        public string? Normals { get; set; }
        /// <summary>"points" of the data, "depth", "random", or a file of a scene; null: "points".</summary>
        public string? Init { get; set; }
        /// <summary>Most bytes on the device; 0: what it has.</summary>
        public long MemoryBytes { get; set; }
        /// <summary>More options, "NAME=VALUE", by the names of a run's config.json.</summary>
        public IReadOnlyList<string>? Values { get; set; }
        /// <summary>Resume, overwrite, white background, refinements.</summary>
        public FitFlags Flags { get; set; }
    }

    /// <summary>
    /// A fit of Gaussians to posed photographs as a run; enumerate it to fit. Numbers of its events are, of a
    /// step, "psnr" of its photograph, "gaussians", "l1", "ssim" and milliseconds such as "raster_ms"; of
    /// photographs held out, "val_psnr" and "val_ssim". Fits of equal photographs, steps and seeds have equal
    /// bits.
    /// </summary>
    public sealed unsafe class Fit : RunBase
    {
        private readonly string folder;

        /// <summary>
        /// Open a run in a folder, which it makes or locks. `data` is the folder of photographs and cameras, a
        /// COLMAP project, or transforms.json and images; null with FitFlags.Resume: the run's.
        /// </summary>
        public Fit(Device device, string folder, string? data, FitOptions? options = null)
            : base(Create(device, folder, data, options ?? new FitOptions()))
        {
            this.folder = folder;
        }

        private static SafeRunHandle Create(Device device, string folder, string? data, FitOptions options)
        {
            Check.NotNull(device, nameof(device));
            Check.NotNull(folder, nameof(folder));
            if ((options.Flags & FitFlags.Resume) == 0) Check.NotNull(data, nameof(data));
            using (var arena = new Arena())
            {
                var desc = new splat_fit_desc
                {
                    struct_size = (uint)sizeof(splat_fit_desc),
                    flags = options.Flags | (options.TestEvery == 0 ? FitFlags.AllPhotos : 0),
                    folder = arena.Text(folder, nameof(folder)),
                    data = arena.Optional(data, nameof(data)),
                    masks = arena.Optional(options.Masks, nameof(options.Masks)),
                    steps = Check.Unsigned(options.Steps, nameof(options.Steps)),
                    seconds = options.Seconds,
                    seed = unchecked((ulong)options.Seed),
                    max_gaussians = (uint)Check.Within(options.MaxGaussians, 0, uint.MaxValue,
                                                       nameof(options.MaxGaussians)),
                    sh_bands = options.ShDegree == null ? 0 : (uint)Check.Within(
                        options.ShDegree.Value, 0, 3, nameof(options.ShDegree)) + 1,
                    downscale = Check.Unsigned(options.Downscale, nameof(options.Downscale)),
                    test_every = Check.Unsigned(options.TestEvery ?? 0, nameof(options.TestEvery)),
                    cameras = options.Cameras,
                    depth = arena.Optional(options.Depth, nameof(options.Depth)),
                    normals = arena.Optional(options.Normals, nameof(options.Normals)),
                    init = arena.Optional(options.Init, nameof(options.Init)),
                    memory_bytes = Check.Unsigned(options.MemoryBytes, nameof(options.MemoryBytes)),
                    values = arena.Texts(options.Values, nameof(options.Values)),
                    value_count = (ulong)(options.Values?.Count ?? 0),
                };
                IntPtr handle;
                Check.Ok(Native.splat_fit_open(device.Handle, &desc, &handle));
                return new SafeRunHandle(handle, true);
            }
        }

        internal override string About => folder;

        /// <summary>
        /// A copy of the Gaussians as they are, in the frame and units of the cameras, to be disposed.
        /// </summary>
        public Scene GetScene() => new Scene(Check.Made(Handle, Native.splat_fit_scene));
    }

    /// <summary>
    /// The scores of any scene on the photographs that a fit holds out, as a run without a folder: an event of each
    /// photograph with "val_psnr" and "val_ssim", then RunEventKind.Validation with their means.
    /// </summary>
    public sealed unsafe class Scoring : RunBase
    {
        private readonly string data;

        /// <summary>
        /// Score a scene in the frame and units of the cameras. Of the options Masks, Downscale, TestEvery, Cameras and
        /// the background are read. With a border above 0 there are also "inner_psnr" and "inner_ssim", without this
        /// share of width and height on each side.
        /// </summary>
        public Scoring(Device device, Scene scene, string data, FitOptions? options = null, double border = 0)
            : base(Create(device, scene, data, options ?? new FitOptions(), border))
        {
            this.data = data;
        }

        private static SafeRunHandle Create(Device device, Scene scene, string data, FitOptions options, double border)
        {
            Check.NotNull(device, nameof(device));
            Check.NotNull(scene, nameof(scene));
            using (var arena = new Arena())
            {
                var desc = new splat_fit_desc
                {
                    struct_size = (uint)sizeof(splat_fit_desc),
                    flags = options.Flags | (options.TestEvery == 0 ? FitFlags.AllPhotos : 0),
                    data = arena.Text(data, nameof(data)),
                    masks = arena.Optional(options.Masks, nameof(options.Masks)),
                    downscale = Check.Unsigned(options.Downscale, nameof(options.Downscale)),
                    test_every = Check.Unsigned(options.TestEvery ?? 0, nameof(options.TestEvery)),
                    cameras = options.Cameras,
                };
                IntPtr handle;
                Check.Ok(Native.splat_fit_score(device.Handle, &desc, scene.Handle, border, &handle));
                return new SafeRunHandle(handle, true);
            }
        }

        internal override string About => data;
    }
}
