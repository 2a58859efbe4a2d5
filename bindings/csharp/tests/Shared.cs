using System;
using System.IO;
using System.Runtime.CompilerServices;

namespace Splat.Tests
{
    /// <summary>What tests have in common: a device, a scene, folders.</summary>
    internal static class Shared
    {
        private static Device device;
        private static string folder;

        /// <summary>One device for the tests that do not dispose it.</summary>
        internal static Device Device
        {
            get { return device ?? (device = new Device()); }
        }

        /// <summary>A folder of this process, removed at the end.</summary>
        internal static string Folder
        {
            get
            {
                if (folder != null) return folder;
                folder = Path.Combine(Path.GetTempPath(), "splat-csharp-" + Guid.NewGuid().ToString("N"));
                Directory.CreateDirectory(folder);
                return folder;
            }
        }

        internal static string PathOf(string name)
        {
            return Path.Combine(Folder, name);
        }

        internal static void Close()
        {
            device?.Dispose();
            if (folder != null) Directory.Delete(folder, true);
        }

        /// <summary>Three opaque Gaussians in a row.</summary>
        internal static Scene ThreeGaussians()
        {
            return new Scene(3, 0, new SceneArrays
            {
                Means = new float[] { -1, 0, 0, 0, 0, 0.5f, 1, 0, 0 },
                LogScales = new float[] { -1, -1, -1, -1, -1, -1, -1, -1, -1 },
                OpacityLogits = new float[] { 4, 4, 4 },
                Sh = new float[] { 1, -1, -1, -1, 1, -1, -1, -1, 1 },
            });
        }

        internal static Rasterizer SmallRasterizer(Device on,
            RasterizerFlags flags = RasterizerFlags.None)
        {
            return new Rasterizer(on, new RasterizerOptions
            {
                Gaussians = 3,
                Views = 2,
                Width = 48,
                Height = 32,
                Flags = flags,
            });
        }

        internal static Camera[] SmallCameras(Scene scene, int count = 1)
        {
            return Camera.Orbit(scene, count, new OrbitOptions { Width = 48, Height = 32 });
        }

        /// <summary>A disc with alpha on 80 x 64 pixels.</summary>
        internal static Image DiscImage()
        {
            var image = new Image(80, 64, 4);
            for (int y = 0; y < 64; ++y)
                for (int x = 0; x < 80; ++x)
                {
                    int at = 4 * (80 * y + x);
                    image.Data[at] = (byte)(3 * x);
                    image.Data[at + 1] = (byte)(3 * y);
                    image.Data[at + 2] = 99;
                    image.Data[at + 3] = (byte)((x - 40) * (x - 40) + (y - 32) * (y - 32) < 500
                        ? 255 : 0);
                }
            return image;
        }

        internal static Picture Disc()
        {
            return new Picture { Image = DiscImage() };
        }

        /// <summary>Wait until the collector has run all finalizers of what is unreachable.</summary>
        internal static void Collect()
        {
            for (int i = 0; i < 3; ++i)
            {
                GC.Collect();
                GC.WaitForPendingFinalizers();
            }
        }

        /// <summary>Call in a frame of its own, so that nothing stays on the stack.</summary>
        [MethodImpl(MethodImplOptions.NoInlining)]
        internal static void Apart(Action action)
        {
            action();
        }
    }
}
