using System;
using System.Collections.Generic;
using System.Linq;
using System.Threading;
using System.Threading.Tasks;

namespace Splat.Tests
{
    /// <summary>Calls that give a task do what those that block do, and report on the way.</summary>
    internal static class TaskTests
    {
        /// <summary>Progress at once, on the thread that computes.</summary>
        private sealed class Seen<T> : List<T>, IProgress<T>
        {
            internal Action<T> Then = item => { };

            public void Report(T item)
            {
                Add(item);
                Then(item);
            }
        }

        [Test]
        private static void PicturesBecomeDrawnScenes()
        {
            using (Device device = Device.OpenAsync().Result)
            using (Predictor predictor = Predictor.OpenAsync(device).Result)
            using (Prediction made = predictor.PredictAsync(Shared.Disc()).Result)
            using (Prediction same = predictor.Predict(new[] { Shared.Disc() }))
            {
                Expect.Same(same.Scene.Read("means"), made.Scene.Read("means"));
                Camera[] cameras = Shared.SmallCameras(made.Scene);
                Image[] drawn = made.Scene.RenderAsync(cameras, null, device).Result;
                Expect.Same(made.Scene.Render(cameras, null, device)[0].Data, drawn[0].Data);
                string path = Shared.PathOf("task.ply");
                made.Scene.SaveAsync(path).Wait();
                using (Scene loaded = Scene.LoadAsync(path).Result) Expect.Equal(made.Scene.Count, loaded.Count);
            }
        }

        [Test]
        private static void TokensEndTasks()
        {
            using (var predictor = new Predictor(Shared.Device))
            using (var source = new CancellationTokenSource())
            {
                Task<Prediction> task = predictor.PredictAsync(new[] { Shared.Disc() }, source.Token);
                source.Cancel();
                // It may have been done before.
                Expect.Equal(task.Status == TaskStatus.RanToCompletion, !Ended(task));
                Task<Prediction> late = predictor.PredictAsync(Shared.Disc(), source.Token);
                Expect.True(Ended(late) && late.IsCanceled, "a task that never begins");
            }
        }

        // Whether a task was cancelled; any other exception of it is thrown.
        private static bool Ended(Task task)
        {
            try
            {
                task.GetAwaiter().GetResult();
                return false;
            }
            catch (OperationCanceledException)
            {
                return true;
            }
        }

        [Test]
        private static void RunsReportEachEventAndTokensInterruptThem()
        {
            var options = new TrainingOptions
            {
                Config = ModelTests.Tiny,
                Values = new[] { "data.root='" + Cars.Folder + "'", "opt.iterations=1000", "logging.val_log=0" },
            };
            using (var source = new CancellationTokenSource())
            using (var training = new Training(Shared.Device, Shared.PathOf("task-run"), options))
            {
                var seen = new Seen<RunEvent> { Then = now => { if (now.Step == 2) source.Cancel(); } };
                RunEvent last = training.RunAsync(seen, source.Token).Result;
                Expect.Equal(RunEventKind.Interrupted, last.Kind);
                Expect.True(ReferenceEquals(last, seen.Last()) && seen.Count >= 3, "all events");
            }
            options.Flags = TrainingFlags.Overwrite;
            options.Values = options.Values.Select(v => v.Replace("1000", "2")).ToArray();
            using (var training = new Training(Shared.Device, Shared.PathOf("task-run"), options))
                Expect.Equal(RunEventKind.Done, training.RunAsync().Result.Kind);
        }

        [Test]
        private static void EvaluationsReportEachObject()
        {
            using (var model = new Model(Shared.Device, new ModelOptions { Config = ModelTests.Tiny }))
            {
                model.Init(1);
                using (Weights weights = model.Store())
                using (var predictor = new Predictor(Shared.Device, new PredictorOptions
                       { Weights = weights, Config = ModelTests.Tiny }))
                using (Dataset data = Cars.Open("test"))
                using (var evaluator = new Evaluator(new EvaluatorOptions { Predictor = predictor, Dataset = data }))
                {
                    var seen = new Seen<ObjectScores>();
                    Expect.Equal(2, evaluator.ScoreAllAsync(seen).Result.Objects);
                    Expect.Same(new[] { 0, 1 }.Select(i => evaluator.Score(i).Novel), seen.Select(s => s.Novel));
                }
            }
        }

        [Test]
        private static void ExportsReportAndEnd()
        {
            var options = new ExportOptions { Layout = "store", Objects = new[] { 1 } };
            using (Dataset data = Cars.Open())
            using (var source = new CancellationTokenSource())
            {
                var seen = new Seen<(long Done, long Total)>();
                data.ExportAsync(Shared.PathOf("task-store"), options, seen).Wait();
                Expect.Equal((30L, 30L), seen.Last());
                seen.Then = now => source.Cancel();
                Task task = data.ExportAsync(Shared.PathOf("task-half"), options, seen, source.Token);
                Expect.True(Ended(task) && task.IsCanceled, "an export that ends early");
                Task none = Dataset.ImportTablesAsync(Cars.Folder);
                Expect.Refused(ResultCode.ErrorNotFound, "lacks tables", () => none.GetAwaiter().GetResult());
            }
        }
    }
}
