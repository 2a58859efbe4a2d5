using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;

namespace Splat.Tests
{
    internal static class FitTests
    {
        private static string photos;

        /// <summary>Eight small photographs of a scene.</summary>
        private static string Photos
        {
            get
            {
                if (photos != null) return photos;
                photos = Shared.PathOf("photos");
                Directory.CreateDirectory(photos);
                string[] names = Enumerable.Range(0, 8).Select(i => i + ".png").ToArray();
                using (Scene scene = Shared.ThreeGaussians())
                {
                    Camera[] cameras = Camera.Orbit(scene, 8, new OrbitOptions { Width = 40, Height = 30 });
                    Image[] images = scene.Render(cameras, new RenderOptions(), Shared.Device);
                    for (int i = 0; i < 8; ++i) images[i].Save(Path.Combine(photos, names[i]));
                    Camera.Save(Path.Combine(photos, "transforms.json"), cameras, names);
                }
                return photos;
            }
        }

        private static FitOptions Options() => new FitOptions { Steps = 60, MaxGaussians = 500, ShDegree = 1 };

        private static Fit Open(string name, FitOptions options) =>
            new Fit(Shared.Device, Shared.PathOf(name), Photos, options);

        [Test]
        private static void TheLossFallsAndTheRunResumes()
        {
            var losses = new List<double>();
            double psnr = 0;
            Func<RunEvent, RunEvent> seen = now =>
            {
                if (now.Kind == RunEventKind.Step) losses.Add(now.Numbers["l1"]);
                if (now.Kind == RunEventKind.Validation) psnr = now.Numbers["val_psnr"];
                if (now.Kind != RunEventKind.ValidatedPiece) return now;
                Expect.Equal("0.png", now.Name);
                Expect.Equal(3 * 40 * 30, now.ReadImages().Length);
                return now;
            };
            var resume = new FitOptions { Flags = FitFlags.Resume };
            float[] means;
            using (Fit fit = Open("fit", Options()))
            {
                while (seen(fit.Next()).Step < 25) { }
                Expect.Refused(ResultCode.ErrorInvalidState, "", () => Open("fit", resume));
                fit.Interrupt();
                Expect.Equal(RunEventKind.Interrupted, fit.Last().Kind);
                using (Scene scene = fit.GetScene()) means = scene.Read("means");
                fit.Dispose();
                Expect.Throws<ObjectDisposedException>(() => fit.GetScene());
            }
            using (var fit = new Fit(Shared.Device, Shared.PathOf("fit"), null, resume))
            {
                using (Scene scene = fit.GetScene()) Expect.Same(means, scene.Read("means"));
                Expect.Equal(RunEventKind.Done, fit.Select(seen).Last().Kind);
                Expect.Equal(60, losses.Count);
                Expect.True(losses.Skip(53).Sum() < 0.9 * losses.Take(7).Sum(), "a lower loss");
                using (Scene scene = fit.GetScene())
                using (var scoring = new Scoring(Shared.Device, scene, Photos, null, 0.1))
                {
                    RunEvent mean = null;
                    foreach (RunEvent now in scoring)
                        if (now.Kind == RunEventKind.Validation) mean = now;
                    Expect.True(Math.Abs(mean.Numbers["val_psnr"] - psnr) < 1e-3, "the fit's score");
                    Expect.True(mean.Numbers.ContainsKey("inner_ssim"), "an inner score");
                    Expect.Refused(ResultCode.ErrorInvalidArgument, "border is 0.5",
                                   () => new Scoring(Shared.Device, scene, Photos, null, 0.5));
                }
                using (Scene scene = fit.GetScene())
                    Expect.True(scene.Count > 0 && scene.Count <= 500 && scene.ShDegree == 1, "a scene");
            }
        }

        [Test]
        private static void RefusesBadInput()
        {
            Expect.Throws<ArgumentNullException>(() => new Fit(Shared.Device, null, Photos));
            Expect.Throws<ArgumentNullException>(() => new Fit(Shared.Device, Shared.PathOf("bad"), null));
            Expect.Throws<ArgumentOutOfRangeException>(() => Open("bad", new FitOptions { ShDegree = 4 }));
            Expect.Throws<ArgumentOutOfRangeException>(() => Open("bad", new FitOptions { Steps = -1 }));
            Expect.Refused(ResultCode.ErrorInvalidArgument, "seconds is 2 and steps 1",
                           () => Open("bad", new FitOptions { Steps = 1, Seconds = 2 }));
            Expect.Refused(ResultCode.ErrorInvalidArgument, "a FitCameras value",
                           () => Open("bad", new FitOptions { Cameras = (FitCameras)9 }));
            Expect.Refused(ResultCode.ErrorInvalidArgument, "with FitFlags.AllPhotos",
                           () => Open("bad", new FitOptions { Flags = FitFlags.AllPhotos, TestEvery = 4 }));
            Expect.Refused(ResultCode.ErrorNotFound, "colmap",
                           () => Open("bad", new FitOptions { Cameras = FitCameras.Colmap }));
            Expect.Refused(ResultCode.ErrorNotFound, "nowhere",
                           () => Open("bad", new FitOptions { Masks = Shared.PathOf("nowhere") }));
            Expect.True(!Directory.Exists(Shared.PathOf("bad")), "an untouched folder");
        }
    }
}
