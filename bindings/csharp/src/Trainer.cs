using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;
using System.Threading;
using Splat.Interop;

namespace Splat
{
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
}
