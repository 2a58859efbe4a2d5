using System.Collections.Concurrent;
using System.Collections.Generic;
using System.Runtime.ExceptionServices;
using System.Runtime.InteropServices;
using System.Threading;
using System;
using Splat.Interop;

namespace Splat
{
    /// <summary>Configurations of networks and trainings.</summary>
    public static unsafe class Config
    {
        /// <summary>JSON array of all keys: type, range, default, meaning.</summary>
        public static string KeysJson() => Text.Get(Native.splat_config_keys);

        /// <summary>JSON array of the configurations of published models: name, about.</summary>
        public static string PresetsJson() => Text.Get(Native.splat_config_presets);

        /// <summary>The text of one of them, YAML, for Merge.</summary>
        public static string Preset(string name)
        {
            using (var arena = new Arena())
            {
                byte* text = arena.Text(name, nameof(name));
                return Text.Get((buffer, capacity, needed) => Native.splat_config_preset(
                    text, buffer, capacity, needed));
            }
        }

        /// <summary>
        /// A configuration with every value, as JSON, from the text of a YAML or JSON file (null:
        /// the defaults) and changes "key=value", such as "opt.base_lr=1e-4".
        /// </summary>
        public static string Merge(string text, params string[] values)
        {
            using (var arena = new Arena())
            {
                byte* from = arena.Optional(text, nameof(text));
                byte** changes = arena.Texts(Check.NotNull(values, nameof(values)), nameof(values));
                return Text.Get((buffer, capacity, needed) => Native.splat_config_merge(
                    from, changes, (UIntPtr)values.Length, buffer, capacity, needed));
            }
        }

        /// <summary>JSON: what a training of that configuration would leave out.</summary>
        public static string CheckJson(string text, params string[] values)
        {
            using (var arena = new Arena())
            {
                byte* from = arena.Optional(text, nameof(text));
                byte** changes = arena.Texts(Check.NotNull(values, nameof(values)), nameof(values));
                return Text.Get((buffer, capacity, needed) => Native.splat_config_check(
                    from, changes, (UIntPtr)values.Length, buffer, capacity, needed));
            }
        }
    }

    /// <summary>B objects with V input and T target images; null: not given.</summary>
    public sealed class TrainerBatch
    {
        /// <summary>[B*V,channels,R,R].</summary>
        public ReadOnlyMemory<float> Images { get; set; }
        /// <summary>[B*V,4,4] row vectors.</summary>
        public ReadOnlyMemory<float> ViewToWorld { get; set; }
        /// <summary>[B*V,4] w x y z.</summary>
        public ReadOnlyMemory<float> Quaternions { get; set; }
        /// <summary>[B*V,2] pixels; null unless data.fov is 0.</summary>
        public ReadOnlyMemory<float> Focals { get; set; }
        /// <summary>[B*V,length] of a custom embedding.</summary>
        public ReadOnlyMemory<float> Embedding { get; set; }
        /// <summary>[B*V,token_dim,tokens].</summary>
        public ReadOnlyMemory<float> Tokens { get; set; }
        /// <summary>[B*V,5,R,R]; null unless opt.lambda_plane is above 0.</summary>
        public ReadOnlyMemory<float> Planes { get; set; }
        /// <summary>[B*T,3,R,R].</summary>
        public ReadOnlyMemory<float> Targets { get; set; }
        /// <summary>B*T, of R x R pixels.</summary>
        public IReadOnlyList<Camera>? Cameras { get; set; }
    }

    /// <summary>
    /// The batches of a training, read ahead of time by threads of the library. The caller
    /// synchronises calls on one object.
    /// </summary>
    public sealed unsafe class Batches : NativeObject<SafeBatchesHandle>
    {
        /// <summary>Begin with a data set that was opened as the configuration says.</summary>
        /// <param name="dataset">may be disposed afterwards</param>
        /// <param name="config">from Config.Merge; null: the defaults</param>
        /// <param name="seed">of the order of objects and the choice of views</param>
        public Batches(Dataset dataset, string? config = null, long seed = 0)
            : base(Create(dataset, config, seed))
        {
        }

        private static SafeBatchesHandle Create(Dataset dataset, string? config, long seed)
        {
            Check.NotNull(dataset, nameof(dataset));
            using (var arena = new Arena())
            {
                IntPtr handle;
                Check.Ok(Native.splat_batches_create(dataset.Handle, arena.Optional(config, nameof(config)),
                                                     unchecked((ulong)seed), &handle));
                return new SafeBatchesHandle(handle, true);
            }
        }

        /// <summary>A copy of batch `step`. Trainer.Step(batches, step) makes no copy.</summary>
        public TrainerBatch Read(long step)
        {
            using (var arena = new Arena())
            {
                arena.Hold(this);  // the arrays live as long as the batches
                splat_trainer_batch native = Next(step);
                var batch = new TrainerBatch
                {
                    Images = Copy(native.images, native.images_count),
                    ViewToWorld = Copy(native.view_to_world, native.view_to_world_count),
                    Quaternions = Copy(native.quaternions, native.quaternions_count),
                    Focals = Copy(native.focals, native.focals_count),
                    Embedding = Copy(native.embedding, native.embedding_count),
                    Tokens = Copy(native.tokens, native.tokens_count),
                    Planes = Copy(native.planes, native.planes_count),
                    Targets = Copy(native.targets, native.targets_count),
                };
                batch.Cameras = Camera.FromNative(new ReadOnlySpan<splat_camera>(
                    native.cameras, checked((int)native.cameras_count)).ToArray());
                return batch;
            }
        }

        private static float[]? Copy(float* from, ulong count) =>
            from == null ? null : Values.Copy(from, checked((int)count));

        /// <summary>Pointers to batch `step`, valid until the next call.</summary>
        internal splat_trainer_batch Next(long step)
        {
            var native = new splat_trainer_batch { struct_size = (uint)sizeof(splat_trainer_batch) };
            Check.Ok(Native.splat_batches_next(Handle, Check.Unsigned(step, nameof(step)), &native));
            return native;
        }
    }

    /// <summary>
    /// A network in training with its optimizer and rasterizer. The caller synchronises calls on
    /// one trainer.
    /// </summary>
    public sealed unsafe class Trainer : NativeObject<SafeTrainerHandle>
    {
        private readonly SafeDeviceHandle device;

        /// <summary>Create a trainer; the parameters of its network are zero, see Model.</summary>
        public Trainer(Device device, string? config = null) : base(Create(device, config))
        {
            this.device = device.Handle;
        }

        private static SafeTrainerHandle Create(Device device, string? config)
        {
            Check.NotNull(device, nameof(device));
            using (var arena = new Arena())
            {
                var desc = new splat_trainer_desc
                {
                    struct_size = (uint)sizeof(splat_trainer_desc),
                    config = arena.Optional(config, nameof(config)),
                };
                IntPtr handle;
                Check.Ok(Native.splat_trainer_create(device.Handle, &desc, &handle));
                return new SafeTrainerHandle(handle, true);
            }
        }

        /// <summary>The network in training, a new object to be disposed.</summary>
        public Model GetModel() => new Model(Check.Made(Handle, Native.splat_trainer_model), device);

        /// <summary>Do one update with arrays of the caller.</summary>
        public TrainerInfo Step(TrainerBatch batch,
            CancellationToken token = default(CancellationToken))
        {
            Check.NotNull(batch, nameof(batch));
            using (var arena = new Arena())
            {
                splat_camera[]? cameras = batch.Cameras == null ? null : Camera.ToNative(batch.Cameras);
                var native = new splat_trainer_batch
                {
                    struct_size = (uint)sizeof(splat_trainer_batch),
                    images = (float*)arena.Pin(batch.Images),
                    images_count = Model.Count(batch.Images, nameof(batch.Images)),
                    view_to_world = (float*)arena.Pin(batch.ViewToWorld),
                    view_to_world_count = Model.Count(batch.ViewToWorld, nameof(batch.ViewToWorld)),
                    quaternions = (float*)arena.Pin(batch.Quaternions),
                    quaternions_count = Model.Count(batch.Quaternions, nameof(batch.Quaternions)),
                    focals = (float*)arena.Pin(batch.Focals),
                    focals_count = Model.Count(batch.Focals, nameof(batch.Focals)),
                    embedding = (float*)arena.Pin(batch.Embedding),
                    embedding_count = Model.Count(batch.Embedding, nameof(batch.Embedding)),
                    tokens = (float*)arena.Pin(batch.Tokens),
                    tokens_count = Model.Count(batch.Tokens, nameof(batch.Tokens)),
                    planes = (float*)arena.Pin(batch.Planes),
                    planes_count = Model.Count(batch.Planes, nameof(batch.Planes)),
                    targets = (float*)arena.Pin(batch.Targets),
                    targets_count = Model.Count(batch.Targets, nameof(batch.Targets)),
                    cameras = (splat_camera*)arena.Pin(cameras),
                    cameras_count = Model.Count<splat_camera>(cameras, nameof(batch.Cameras)),
                };
                return Step(&native, token);
            }
        }

        /// <summary>Do one update with batch `step` of `batches`, without a copy.</summary>
        public TrainerInfo Step(Batches batches, long step,
                                CancellationToken token = default(CancellationToken))
        {
            Check.NotNull(batches, nameof(batches));
            using (var arena = new Arena())
            {
                arena.Hold(batches);  // the arrays live as long as the batches
                splat_trainer_batch native = batches.Next(step);
                return Step(&native, token);
            }
        }

        /// <summary>Do one update with batch `step` of `batches`; what it did is not read from the device, until
        /// Read.</summary>
        public void StepUnread(Batches batches, long step,
                               CancellationToken token = default(CancellationToken))
        {
            Check.NotNull(batches, nameof(batches));
            using (var arena = new Arena())
            using (Cancellation.Of(device, token))
            {
                arena.Hold(batches);  // the arrays live as long as the batches
                splat_trainer_batch native = batches.Next(step);
                Check.Ok(Native.splat_trainer_step(Handle, &native, null), token);
            }
        }

        /// <summary>What the steps of StepUnread did, oldest first, each once.</summary>
        public IReadOnlyList<TrainerInfo> Read()
        {
            UIntPtr count;
            Check.Ok(Native.splat_trainer_read(Handle, null, UIntPtr.Zero, &count));
            var natives = new splat_trainer_info[(int)count];
            var infos = new TrainerInfo[natives.Length];
            for (int i = 0; i < natives.Length; ++i)
                natives[i].struct_size = (uint)sizeof(splat_trainer_info);
            fixed (splat_trainer_info* first = natives)
            {
                if (infos.Length > 0) Check.Ok(Native.splat_trainer_read(Handle, first, count, null));
                for (int i = 0; i < infos.Length; ++i) infos[i] = new TrainerInfo(first + i);
            }
            return infos;
        }

        private TrainerInfo Step(splat_trainer_batch* batch, CancellationToken token)
        {
            var info = new splat_trainer_info { struct_size = (uint)sizeof(splat_trainer_info) };
            using (Cancellation.Of(device, token))
                Check.Ok(Native.splat_trainer_step(Handle, batch, &info), token);
            return new TrainerInfo(&info);
        }

        /// <summary>JSON: steps, attempts, steps unread and skipped, parameters, configuration.</summary>
        public string ReportJson() => Text.Get(Handle, Native.splat_trainer_report);

        /// <summary>The averaged weights as a state dict; without averages the current ones.</summary>
        public Weights Store() => new Weights(Check.Made(Handle, Native.splat_trainer_store));

        /// <summary>Save everything that the next step depends on.</summary>
        public void Save(string path)
        {
            using (var arena = new Arena())
                Check.Ok(Native.splat_trainer_save(Handle, arena.Text(path, nameof(path))));
        }

        /// <summary>The bytes of such a file.</summary>
        public byte[] ToBytes() =>
            Text.GetBytes((buffer, capacity, needed) =>
                Native.splat_trainer_save_memory(Handle, buffer, capacity, needed));

        /// <summary>Resume from such a file, bit-exactly.</summary>
        public void Resume(string path)
        {
            using (var arena = new Arena())
                Check.Ok(Native.splat_trainer_resume(Handle, arena.Text(path, nameof(path))));
        }

        /// <summary>Resume from the bytes of such a file.</summary>
        public void Resume(ReadOnlySpan<byte> bytes)
        {
            fixed (byte* data = &MemoryMarshal.GetReference(bytes))
                Check.Ok(Native.splat_trainer_resume_memory(Handle, data, (UIntPtr)bytes.Length));
        }
    }

    /// <summary>
    /// The ranks of a training, and what this one reaches the others by: a class of yours. All ranks make the same
    /// calls in the same order, on a thread of the library's choice. What a method throws ends the training and is
    /// thrown by the call of it that runs; other ranks get it as a sentence, or wait until their own method gives up:
    /// it needs a time limit. Each object serves one training.
    /// </summary>
    public abstract unsafe class Ranks
    {
        private const int TextBytes = 1000;

        // The library holds their pointers, so they are never collected.
        private static readonly splat_group_send_receive SendReceiveCall = CallSendReceive;
        private static readonly splat_group_broadcast BroadcastCall = CallBroadcast;
        private static readonly splat_group_barrier BarrierCall = CallBarrier;
        private static readonly splat_group_sum SumCall = CallSum;
        private static readonly splat_group_describe DescribeCall = CallDescribe;

        // A training keeps its ranks; a call for others, such as at the end of the process, fails.
        private static readonly ConcurrentDictionary<long, WeakReference<Ranks>> Known =
            new ConcurrentDictionary<long, WeakReference<Ranks>>();
        private static long last;

        private readonly long id = Interlocked.Increment(ref last);
        private readonly IntPtr text = Marshal.AllocHGlobal(TextBytes);
        private Exception? thrown;

        /// <summary>
        /// Rank 0 ... count - 1, of which 0 has the folder of the run; count is a power of two, at most 4096.
        /// </summary>
        protected Ranks(int rank, int count)
        {
            Rank = rank;
            Count = count;
            Marshal.WriteByte(text, 0);
            Known[id] = new WeakReference<Ranks>(this);
        }

        /// <summary>Frees the text of errors.</summary>
        ~Ranks()
        {
            Known.TryRemove(id, out _);
            Marshal.FreeHGlobal(text);
        }

        /// <summary>Number of this rank.</summary>
        public int Rank { get; }
        /// <summary>Number of ranks.</summary>
        public int Count { get; }

        /// <summary>Send bytes to a rank and receive as many from it, which makes the same call.</summary>
        public abstract void SendReceive(int peer, ReadOnlySpan<byte> sent, Span<byte> received);

        /// <summary>Give the bytes of rank `root` to all.</summary>
        public abstract void Broadcast(int root, Span<byte> data);

        /// <summary>Return when all ranks have called it.</summary>
        public abstract void Barrier();

        /// <summary>
        /// Whether Sum sums gradients. If not, they are summed in a fixed order, and 1, 2, 4... ranks have the same
        /// bits.
        /// </summary>
        public virtual bool Sums => false;

        /// <summary>
        /// Replace numbers by their sums over all ranks, in any order: then runs cannot be reproduced.
        /// </summary>
        public virtual void Sum(Span<float> values) =>
            throw new NotImplementedException(GetType().Name + " has no Sum");

        /// <summary>What the library calls; valid while the object lives.</summary>
        internal splat_group Group() =>
            new splat_group
            {
                struct_size = (uint)sizeof(splat_group),
                rank = Check.Unsigned(Rank, "Ranks.Rank"),
                count = Check.Unsigned(Count, "Ranks.Count"),
                user = (void*)id,
                send_receive = Marshal.GetFunctionPointerForDelegate(SendReceiveCall),
                broadcast = Marshal.GetFunctionPointerForDelegate(BroadcastCall),
                barrier = Marshal.GetFunctionPointerForDelegate(BarrierCall),
                sum = Sums ? Marshal.GetFunctionPointerForDelegate(SumCall) : IntPtr.Zero,
                describe = Marshal.GetFunctionPointerForDelegate(DescribeCall),
            };

        /// <summary>Throw what a method threw, if one did.</summary>
        internal void Rethrow()
        {
            if (thrown != null) ExceptionDispatchInfo.Capture(thrown).Throw();
        }

        private static Ranks? Of(void* user) =>
            Known.TryGetValue((long)user, out WeakReference<Ranks>? kept) && kept.TryGetTarget(out Ranks? found)
                ? found
                : null;

        private int Failed(Exception error)
        {
            if (thrown == null) thrown = error;
            byte[] bytes = System.Text.Encoding.UTF8.GetBytes(error.GetType().Name + ": " + error.Message);
            int count = Math.Min(bytes.Length, TextBytes - 1);
            while (count < bytes.Length && count > 0 && (bytes[count] & 0xC0) == 0x80) --count;  // whole letters
            Marshal.Copy(bytes, 0, text, count);
            Marshal.WriteByte(text, count, 0);
            return 1;
        }

        private static int CallSendReceive(void* user, uint peer, void* sent, void* received, ulong bytes)
        {
            Ranks? ranks = Of(user);
            if (ranks == null) return 1;
            try
            {
                int count = checked((int)bytes);
                ranks.SendReceive((int)peer, new ReadOnlySpan<byte>(sent, count), new Span<byte>(received, count));
                return 0;
            }
            catch (Exception error)
            {
                return ranks.Failed(error);
            }
        }

        private static int CallBroadcast(void* user, uint root, void* data, ulong bytes)
        {
            Ranks? ranks = Of(user);
            if (ranks == null) return 1;
            try
            {
                ranks.Broadcast((int)root, new Span<byte>(data, checked((int)bytes)));
                return 0;
            }
            catch (Exception error)
            {
                return ranks.Failed(error);
            }
        }

        private static int CallBarrier(void* user)
        {
            Ranks? ranks = Of(user);
            if (ranks == null) return 1;
            try
            {
                ranks.Barrier();
                return 0;
            }
            catch (Exception error)
            {
                return ranks.Failed(error);
            }
        }

        private static int CallSum(void* user, float* values, ulong count)
        {
            Ranks? ranks = Of(user);
            if (ranks == null) return 1;
            try
            {
                ranks.Sum(new Span<float>(values, checked((int)count)));
                return 0;
            }
            catch (Exception error)
            {
                return ranks.Failed(error);
            }
        }

        private static byte* CallDescribe(void* user, int number)
        {
            Ranks? ranks = Of(user);
            return ranks == null ? null : (byte*)ranks.text;
        }
    }
}
