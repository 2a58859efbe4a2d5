using System;
using System.IO;
using System.Reflection;
using System.Text;
using System.Threading;
using Splat.Interop;

namespace Splat.Tests
{
    /// <summary>Runs that need a process of their own; csharp_test.sh judges them.</summary>
    internal static class Programs
    {
        internal static bool Has(string name)
        {
            return name == "fake-library" || name == "load" || name == "open" || name == "lend" ||
                   name == "sentences" || name == "leave-objects" || name == "leave-computing" ||
                   name == "leave-by-exit";
        }

        internal static int Run(string name, string[] arguments)
        {
            switch (name)
            {
                case "fake-library": return FakeLibrary(arguments);
                case "sentences": return Sentences();
                case "load": return First(() => "loaded " + Library.Version);
                case "open": return First(() => "opened " + new Device().Info.Name);
                case "lend": return Lend();
                case "leave-objects": return LeaveObjects();
                case "leave-computing": return LeaveComputing(false);
                default: return LeaveComputing(true);
            }
        }

        /// <summary>Writes the words of C# for the sentences in a file; bindings/smoke/sentences.py judges.</summary>
        private static int Sentences()
        {
            foreach (string line in
                     File.ReadAllLines(Environment.GetEnvironmentVariable("SPLAT_SENTENCES")))
                Console.WriteLine("> " + Told(line));
            return 0;
        }

        internal static string Told(string sentence) =>
            (string)typeof(Library).Assembly.GetType("Splat.OwnWords")
                .GetMethod("In", BindingFlags.Static | BindingFlags.NonPublic).Invoke(null, new object[] { sentence });

        /// <summary>
        /// The C source of a library that only tells its version and structs. Arguments: version,
        /// and the name of a struct that is 8 bytes shorter than the headers say, or "none".
        /// </summary>
        private static int FakeLibrary(string[] arguments)
        {
            var structs = new StringBuilder();
            foreach (NativeLayout layout in NativeLayout.All)
            {
                string name = layout.Type.Name;
                int size = name == arguments[1] ? layout.Size - 8 : layout.Size;
                structs.Append(structs.Length == 0 ? "" : ", ");
                structs.Append("\\\"" + name + "\\\": " + size);
            }
            Console.WriteLine("const char* splat_version_string(void) { return \"" + arguments[0] + "\"; }");
            Console.WriteLine("const char* splat_build_info(void) { return \"{\\\"structs\\\": {" + structs +
                              "}}\"; }");
            return 0;
        }

        /// <summary>Print what the first use of the library throws.</summary>
        private static int First(Func<string> use)
        {
            try
            {
                Console.WriteLine(use());
                return 0;
            }
            catch (SplatException error)
            {
                Console.WriteLine(error.Code + ": " + error.Message);
            }
            catch (DllNotFoundException error)
            {
                Console.WriteLine("DllNotFoundException: " + error.Message);
            }
            return 1;
        }

        /// <summary>
        /// What the library of lender.c lends is copied before it is gone, though the log's handler
        /// disposes its object while the call runs, as a finaliser may right after it.
        /// </summary>
        private static int Lend()
        {
            Log.SetHandler((level, message) => lender.Dispose());
            var device = new Device();
            var options = new EvaluatorOptions { Method = "none" };
            foreach (Func<PriorModelInfo, string> read in new Func<PriorModelInfo, string>[]
                     { i => i.Preset, i => i.Licence, i => i.Note, i => i.Path, i => i.RuntimeVersion })
                Lend(new PriorModel("none"), m => read(m.Info));
            Lend(Weights.Load("none"), w => w[0].Name);
            Lend(Weights.Load("none"), w => w[0].Dtype);
            Lend(new Predictor(device), p => p.Info.Category);
            Lend(new Evaluator(options), e => e.Score(0).Name);
            Lend(new Evaluator(options), e => e.ScoreImages(0, new float[1]).Name);
            Lend(new Model(device), m => m.Ports(PortKind.Input)[0].Name);
            Lend(new Module(device, new ModuleOptions()), m => m.Ports(PortKind.Input)[0].Name);
            Lend(new Training(device, "none"), t => t.Next().Message);
            Lend(new Training(device, "none"), t => t.Next().Name);
            Lend(new Batches(new Dataset("none")), b => string.Join(" ", b.Read(0).Images.ToArray()));
            return wrong;
        }

        private static IDisposable lender;
        private static int wrong;

        private static void Lend<T>(T item, Func<T, string> read) where T : IDisposable
        {
            lender = item;
            string got = read(item);
            Console.WriteLine(typeof(T).Name + ": " + got);
            if (got != "lent" && got != "1 2") ++wrong;
        }

        /// <summary>Return from Main with live objects of all kinds and a log handler.</summary>
        private static int LeaveObjects()
        {
            Log.SetHandler((level, message) => Console.Error.WriteLine(message), LogLevel.Debug);
            Kept = new object[]
            {
                new Device(), Shared.ThreeGaussians(), Shared.SmallRasterizer(Shared.Device),
                new Predictor(Shared.Device), new Tensor(Shared.Device, new long[] { 4 }),
                Weights.Load(Weights.BuiltinPath()),
            };
            return 0;
        }

        /// <summary>Leave while a background thread computes and a token watches it.</summary>
        private static int LeaveComputing(bool byExit)
        {
            Log.SetHandler((level, message) => Console.Error.WriteLine(message), LogLevel.Debug);
            var predictor = new Predictor(Shared.Device);
            var source = new CancellationTokenSource();
            Kept = new object[] { predictor, source };
            var running = new ManualResetEventSlim();
            new Thread(() =>
            {
                while (true)
                {
                    using (Prediction result = predictor.Predict(Shared.Disc(), source.Token))
                        running.Set();
                }
            }) { IsBackground = true }.Start();
            running.Wait();
            if (byExit) Environment.Exit(5);
            return 0;
        }

        /// <summary>Objects that are alive when the process ends.</summary>
        internal static object[] Kept;
    }
}
