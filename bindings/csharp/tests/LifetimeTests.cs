using System;
using System.Collections.Concurrent;
using System.Collections.Generic;
using System.Linq;
using System.Threading;

namespace Splat.Tests
{
    internal static class LogTests
    {
        [Test]
        private static void MessagesComeOnTheCallersThread()
        {
            var messages = new List<string>();
            var threads = new HashSet<int>();
            Log.SetHandler((level, message) =>
            {
                messages.Add(level + " " + message);
                threads.Add(Thread.CurrentThread.ManagedThreadId);
                GC.KeepAlive(Library.Version);  // a handler may call the library
            }, LogLevel.Info);
            using (new Device()) { }
            Log.SetHandler(null);
            Expect.True(messages.Any(m => m.StartsWith("Info device ")), "a message of the device");
            Expect.Same(new[] { Thread.CurrentThread.ManagedThreadId }, threads);
            int before = messages.Count;
            using (new Device()) { }
            Expect.Equal(before, messages.Count);
        }

        [Test]
        private static void AnExceptionOfAHandlerStaysWithTheHandler()
        {
            Exception seen = null;
            Action<Exception> listener = error => seen = error;
            Log.HandlerFailed += listener;
            Log.SetHandler((level, message) =>
                { throw new InvalidOperationException("of the handler"); },
                           LogLevel.Debug);
            try
            {
                using (var device = new Device())
                using (var tensor = new Tensor(device, new long[] { 2 }))
                    Expect.Same(new float[2], tensor.ToArray());
            }
            finally
            {
                Log.SetHandler(null);
                Log.HandlerFailed -= listener;
            }
            Expect.Equal("of the handler", seen.Message);
            Expect.Equal(seen, Log.LastFailure);
        }

        [Test]
        private static void ALevelThatDoesNotExistChangesNothing()
        {
            int count = 0;
            Log.SetHandler((level, message) => ++count, LogLevel.Info);
            Expect.Refused(ResultCode.ErrorInvalidArgument, "minimum",
                           () => Log.SetHandler((level, message) => { }, (LogLevel)77));
            using (new Device()) { }
            Log.SetHandler(null);
            Expect.True(count > 0, "the handler before");
        }

        [Test]
        private static void HandlersOutliveTheCollector()
        {
            int count = 0;
            Shared.Apart(() => Log.SetHandler((level, message) => Interlocked.Increment(ref count),
                LogLevel.Info));
            Shared.Collect();
            using (new Device()) { }
            Log.SetHandler(null);
            Expect.True(count > 0, "messages after a collection");
        }
    }

    internal static class ThreadsTests
    {
        private static void WhileComputing(Predictor predictor, Action action)
        {
            Exception failure = null;
            long gaussians = 0;
            var started = new ManualResetEventSlim();
            var worker = new Thread(() =>
            {
                try
                {
                    for (int i = 0; i < 3; ++i)
                    {
                        started.Set();
                        using (Prediction result = predictor.Predict(Shared.Disc()))
                            gaussians = result.Gaussians;
                    }
                }
                catch (Exception error)
                {
                    failure = error;
                }
            });
            worker.Start();
            started.Wait();
            action();
            worker.Join();
            if (failure != null)
                throw new InvalidOperationException("the other thread failed", failure);
            Expect.True(gaussians > 100, "predictions");
        }

        [Test]
        private static void OthersAreDisposedWhileOneComputes()
        {
            var device = new Device();
            var predictor = new Predictor(device);
            List<IDisposable> others = Enumerable.Range(0, 8)
                .Select(i => (IDisposable)new Tensor(device, new long[] { 64, 64 })).ToList();
            others.Add(Shared.SmallRasterizer(device));
            others.Add(ModuleTests.Linear());
            WhileComputing(predictor, () =>
            {
                device.Dispose();
                foreach (IDisposable other in others) other.Dispose();
            });
            predictor.Dispose();
        }

        [Test]
        private static void TheComputingObjectIsDisposed()
        {
            var predictor = new Predictor(Shared.Device);
            using (predictor.Predict(Shared.Disc())) { }
            int done = 0;
            Exception end = null;
            var worker = new Thread(() =>
            {
                try
                {
                    while (true)
                    {
                        using (predictor.Predict(Shared.Disc())) Interlocked.Increment(ref done);
                    }
                }
                catch (Exception error)
                {
                    end = error;
                }
            });
            worker.Start();
            while (Volatile.Read(ref done) == 0) Thread.Sleep(1);
            predictor.Dispose();
            worker.Join();
            Expect.Equal(typeof(ObjectDisposedException), end.GetType());
        }

        [Test]
        private static void OneDeviceServesManyThreads()
        {
            using (Scene scene = Shared.ThreeGaussians())
            {
                Camera[] cameras = Shared.SmallCameras(scene);
                float[][] images = new int[6].AsParallel().WithDegreeOfParallelism(6).Select(i =>
                {
                    using (Rasterizer rasterizer = Shared.SmallRasterizer(Shared.Device))
                    {
                        rasterizer.Forward(scene, cameras);
                        return rasterizer.Read(Output.Rgb);
                    }
                }).ToArray();
                foreach (float[] image in images) Expect.Same(images[0], image);
            }
        }

        [Test]
        private static void ATokenCancelsALongCall()
        {
            using (var device = new Device())
            using (var predictor = new Predictor(device))
            using (var source = new CancellationTokenSource())
            {
                var other = new Thread(() =>
                {
                    Thread.Sleep(30);
                    source.Cancel();
                });
                other.Start();
                OperationCanceledException error = Expect.Throws<OperationCanceledException>(() =>
                {
                    while (true) predictor.Predict(Shared.Disc(), source.Token).Dispose();
                });
                other.Join();
                Expect.Equal(source.Token, error.CancellationToken);
                // Usable afterwards, with a token that is not cancelled.
                using (var next = new CancellationTokenSource())
                using (Prediction result = predictor.Predict(Shared.Disc(), next.Token))
                    Expect.True(result.Gaussians > 100, "a prediction after a cancelled one");
                Expect.Equal(source.Token, Expect.Throws<OperationCanceledException>(
                    () => predictor.Predict(Shared.Disc(), source.Token)).CancellationToken);
            }
        }

        [Test]
        private static void ATokenFiredDuringACallEndsThatCall()
        {
            // Cancelled from inside the call's own start, when nothing may run on the device yet.
            using (var device = new Device())
            using (var predictor = new Predictor(device))
            {
                predictor.Predict(Shared.Disc()).Dispose();
                int cancelled = 0;
                for (int i = 0; i < 4; ++i)
                    using (var source = new CancellationTokenSource())
                    {
                        source.CancelAfter(2 * i);
                        try
                        {
                            for (int k = 0; k < 1000; ++k)
                                predictor.Predict(Shared.Disc(), source.Token).Dispose();
                        }
                        catch (OperationCanceledException)
                        {
                            ++cancelled;
                        }
                    }
                Expect.Equal(4, cancelled);
            }
        }

        [Test]
        private static void CancelOfTheDeviceNeedsNoToken()
        {
            using (var device = new Device())
            using (var predictor = new Predictor(device))
            {
                bool done = false;
                var other = new Thread(() =>
                {
                    while (!Volatile.Read(ref done))
                    {
                        device.Cancel();
                        Thread.Sleep(1);
                    }
                });
                other.Start();
                OperationCanceledException error = Expect.Throws<OperationCanceledException>(() =>
                {
                    while (true) predictor.Predict(Shared.Disc()).Dispose();
                });
                Volatile.Write(ref done, true);
                other.Join();
                Expect.Equal(CancellationToken.None, error.CancellationToken);
                Expect.Equal(ResultCode.Cancelled, ((SplatException)error.InnerException).Code);
                Expect.True(error.Message.Length > 10, "the library's text");
            }
        }

        [Test]
        private static void ATokenNeedsALiveDevice()
        {
            var device = new Device();
            using (Scene scene = Shared.ThreeGaussians())
            using (Rasterizer rasterizer = Shared.SmallRasterizer(device))
            using (var source = new CancellationTokenSource())
            {
                device.Dispose();
                Camera[] cameras = Shared.SmallCameras(scene);
                rasterizer.Forward(scene, cameras);
                Expect.Throws<ObjectDisposedException>(
                    () => rasterizer.Forward(scene, cameras, null, null, source.Token));
            }
        }
    }

    internal static class CollectorTests
    {
        // What is unreachable is collected on the collector's thread, in any order.
        private static void Litter(Device device)
        {
            var tensor = new Tensor(device, new long[] { 256, 256 });
            Scene scene = Shared.ThreeGaussians();
            Rasterizer rasterizer = Shared.SmallRasterizer(device);
            RasterizerState state = rasterizer.CreateState();
            rasterizer.Forward(scene, Shared.SmallCameras(scene), null, state);
            new Predictor(device).Predict(Shared.Disc());
            Weights.Load(Weights.BuiltinPath());
            GC.KeepAlive(tensor);
        }

        [Test]
        private static void LostObjectsGiveTheirMemoryBack()
        {
            using (var device = new Device())
            {
                Shared.Apart(() => Litter(device));
                Expect.True(device.Memory.LiveBytes > 0 || device.Memory.PeakBytes > 0, "memory in use");
                // The collector is conservative about stacks, so a thread of its own makes the
                // objects.
                for (int i = 0; i < 3; ++i)
                {
                    var maker = new Thread(() => Litter(device));
                    maker.Start();
                    maker.Join();
                    Overwrite(64);
                    Shared.Collect();
                }
                long peak = device.Memory.PeakBytes;
                for (int i = 0; i < 3; ++i) Shared.Collect();
                Expect.True(device.Memory.LiveBytes < peak, "less than the peak");
            }
        }

        // Clear stale references on the stack.
        private static int Overwrite(int depth)
        {
            Span<byte> none = new byte[64];
            return depth == 0 ? none.Length : Overwrite(depth - 1) + 1;
        }

        [Test]
        private static void DevicesAndChildrenAreCollectedTogether()
        {
            for (int i = 0; i < 3; ++i)
            {
                var maker = new Thread(() => Litter(new Device()));
                maker.Start();
                maker.Join();
                Shared.Collect();
            }
        }

        [Test]
        private static void CollectionsDuringCallsDoNoHarm()
        {
            bool done = false;
            var collector = new Thread(() =>
            {
                while (!Volatile.Read(ref done)) GC.Collect();
            });
            collector.Start();
            try
            {
                var results = new ConcurrentBag<float>();
                for (int i = 0; i < 20; ++i)
                    results.Add(Tensor.From(Shared.Device, new float[] { i, 2 }, 2).ToArray()[0]);
                Expect.Equal(20, results.Count);
                using (Prediction result = new Predictor(Shared.Device).Predict(Shared.Disc()))
                    Expect.True(result.Gaussians > 100, "a prediction of a predictor that nothing holds");
                foreach (WeightsInfo info in Enumerable.Range(0, 5).Select(i =>
                    Weights.Load(Weights.BuiltinPath())[i]))
                    Expect.True(info.Name.Length > 0, "a name of weights that nothing holds");
            }
            finally
            {
                Volatile.Write(ref done, true);
                collector.Join();
            }
        }

        [Test]
        private static void FailedConstructorsLeaveNothing()
        {
            for (int i = 0; i < 50; ++i)
            {
                Expect.Throws<SplatException>(() => new Tensor(Shared.Device, new long[] { 0 }));
                Expect.Throws<SplatException>(() => new Predictor(
                    Shared.Device, new PredictorOptions { WeightsPath = "none" }));
                Expect.Throws<ObjectDisposedException>(() => new Tensor(Disposed(), new long[] { 1 }));
            }
            Shared.Collect();
            using (var tensor = new Tensor(Shared.Device, new long[] { 1 }))
                Expect.Same(new float[1], tensor.ToArray());
        }

        private static readonly Device dead = new Device();

        private static Device Disposed()
        {
            dead.Dispose();
            return dead;
        }
    }
}
