using System;
using System.Collections;
using System.Collections.Generic;
using System.Threading;
using Splat.Interop;

namespace Splat
{
    /// <summary>How to open a training session.</summary>
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

    /// <summary>What one piece of work of a training did.</summary>
    public sealed unsafe class TrainingEvent
    {
        private readonly Training training;
        private readonly long serial;
        private readonly float* images;
        private readonly float* truths;
        private readonly int count;

        internal TrainingEvent(Training training, long serial, splat_training_event* from)
        {
            this.training = training;
            this.serial = serial;
            images = from->images;
            truths = from->truths;
            count = checked((int)from->image_count);
            Kind = from->kind;
            Message = Text.Read(from->text, -1);
            IsWarning = from->warning != 0;
            IsLogged = from->logged != 0;
            Step = checked((long)from->step);
            Attempts = checked((long)from->attempts);
            Iterations = checked((long)from->iterations);
            Skipped = checked((long)from->skipped);
            PeakBytes = checked((long)from->peak_bytes);
            Info = from->info == null ? null : new TrainerInfo(from->info);
            Psnr = from->psnr;
            AveragedLoss = from->averaged_loss;
            Seconds = from->seconds;
            StepsPerSecond = from->steps_per_second;
            Name = Text.Read(from->name, -1);
            Object = checked((int)from->@object);
            Objects = checked((int)from->objects);
            Views = checked((int)from->views);
            Inputs = checked((int)from->inputs);
            Side = checked((int)from->side);
            NovelPsnr = from->novel_psnr;
            NovelSsim = from->novel_ssim;
            ConditioningPsnr = from->conditioning_psnr;
            ConditioningSsim = from->conditioning_ssim;
            BestPsnr = from->best_psnr;
        }

        /// <summary>Step, validation, checkpoint, or what ended the run.</summary>
        public TrainingEventKind Kind { get; }
        /// <summary>The line of log.txt; null: none.</summary>
        public string Message { get; }
        /// <summary>The message warns.</summary>
        public bool IsWarning { get; }
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
        /// <summary>Facts of the step; null unless the event is one.</summary>
        public TrainerInfo Info { get; }
        /// <summary>dB, of the step's targets.</summary>
        public double Psnr { get; }
        /// <summary>Over the latest steps.</summary>
        public double AveragedLoss { get; }
        /// <summary>Since the first step of this session.</summary>
        public double Seconds { get; }
        /// <summary>Speed of the latest steps.</summary>
        public double StepsPerSecond { get; }
        /// <summary>Name of the validated object, else null.</summary>
        public string Name { get; }
        /// <summary>Number of the validated object.</summary>
        public int Object { get; }
        /// <summary>Objects in the validation.</summary>
        public int Objects { get; }
        /// <summary>Views of the object, the input views first.</summary>
        public int Views { get; }
        /// <summary>Input views of them.</summary>
        public int Inputs { get; }
        /// <summary>Pixels of an image.</summary>
        public int Side { get; }
        /// <summary>NaN without novel views.</summary>
        public double NovelPsnr { get; }
        /// <summary>NaN without novel views.</summary>
        public double NovelSsim { get; }
        /// <summary>Mean over input views.</summary>
        public double ConditioningPsnr { get; }
        /// <summary>Mean over input views.</summary>
        public double ConditioningSsim { get; }
        /// <summary>Best validation with as many objects and views.</summary>
        public double BestPsnr { get; }

        /// <summary>True for the last event of a run.</summary>
        public bool IsEnd
        {
            get { return Kind >= TrainingEventKind.Done; }
        }

        /// <summary>
        /// Copy of the drawn images [views,3,side,side] of a validated object; empty for other
        /// events. Throws InvalidOperationException once the session has gone on.
        /// </summary>
        public float[] ReadImages()
        {
            return training.Copy(serial, images, count);
        }

        /// <summary>Copy of the true images, see ReadImages.</summary>
        public float[] ReadTruths()
        {
            return training.Copy(serial, truths, count);
        }
    }

    /// <summary>
    /// A training with its folder; enumerate it to train. The last event is the one whose IsEnd is
    /// true. The caller synchronises calls on one session, except Interrupt and Dispose.
    /// </summary>
    public sealed unsafe class Training : NativeObject<SafeTrainingHandle>,
        IEnumerable<TrainingEvent>
    {
        private readonly SafeDeviceHandle device;
        private long serial;

        /// <summary>Open a session in a folder, which it makes or locks.</summary>
        public Training(Device device, string folder, TrainingOptions options = null)
            : base(Create(device, folder, options ?? new TrainingOptions()))
        {
            this.device = device.Handle;
        }

        private static SafeTrainingHandle Create(Device device, string folder,
            TrainingOptions options)
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
                    values = arena.Texts(options.Values),
                    value_count = (ulong)(options.Values?.Count ?? 0),
                    dataset = arena.Hold(options.Dataset),
                    validation = arena.Hold(options.Validation),
                    init = arena.Text(options.Init),
                    init_flags = options.InitFlags,
                };
                IntPtr handle;
                Check.Ok(Native.splat_training_open(device.Handle, &desc, &handle));
                return new SafeTrainingHandle(handle, true);
            }
        }

        /// <summary>Do the next piece of work. After an error the next call tries it
        /// again.</summary>
        public TrainingEvent Next()
        {
            SafeTrainingHandle handle = Handle;
            bool added = false;
            try
            {
                handle.DangerousAddRef(ref added);  // the event's texts live as long as the session
                ++serial;
                var native = new splat_training_event
                    { struct_size = (uint)sizeof(splat_training_event) };
                Check.Ok(Native.splat_training_next(handle, &native));
                return new TrainingEvent(this, serial, &native);
            }
            finally
            {
                if (added) handle.DangerousRelease();
            }
        }

        /// <summary>
        /// Train to the end. A token that is cancelled interrupts the session: the state is saved,
        /// the last event is TrainingEventKind.Interrupted, and the run can be resumed.
        /// </summary>
        public IEnumerable<TrainingEvent> Run(CancellationToken token)
        {
            using (token.Register(InterruptQuietly))
            {
                TrainingEvent last;
                do
                {
                    last = Next();
                    yield return last;
                } while (!last.IsEnd);
            }
        }

        /// <summary>Train to the end, one event after the other.</summary>
        public IEnumerator<TrainingEvent> GetEnumerator()
        {
            return Run(CancellationToken.None).GetEnumerator();
        }

        IEnumerator IEnumerable.GetEnumerator()
        {
            return GetEnumerator();
        }

        /// <summary>
        /// End the session: the next piece of work saves the state and is
        /// TrainingEventKind.Interrupted. Any thread may call it.
        /// </summary>
        public void Interrupt()
        {
            Check.Ok(Native.splat_training_interrupt(Handle));
        }

        // A session that is disposed meanwhile needs no interruption.
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
        public string ReportJson()
        {
            return Text.Get((buffer, capacity, needed) =>
                Native.splat_training_report(Handle, buffer, capacity, needed));
        }

        /// <summary>The network in training, a new object to be disposed.</summary>
        public Model GetModel()
        {
            IntPtr model;
            Check.Ok(Native.splat_training_model(Handle, &model));
            return new Model(model, device);
        }

        internal float[] Copy(long ofEvent, float* from, int count)
        {
            SafeTrainingHandle handle = Handle;
            bool added = false;
            try
            {
                handle.DangerousAddRef(ref added);
                if (ofEvent != serial)
                    throw new InvalidOperationException(
                        "The session has gone on; read the images of an event before the next one.");
                return from == null ? new float[0] : Values.Copy(from, count);
            }
            finally
            {
                if (added) handle.DangerousRelease();
            }
        }
    }
}
