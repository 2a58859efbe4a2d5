using System;
using System.IO;
using System.Linq;

namespace Splat.Tests
{
    internal static class ImageTests
    {
        private static Image Gradient(int channels, Pixel type = Pixel.U8)
        {
            var image = new Image(5, 3, channels, type);
            if (type == Pixel.U8)
                for (int i = 0; i < image.Data.Length; ++i) image.Data[i] = (byte)(i * 4);
            return image;
        }

        [Test]
        private static void FilesAndBytesKeepIt()
        {
            Image image = Gradient(4);
            string path = Shared.PathOf("bild ü.png");
            image.Save(path);
            Image loaded = Image.Load(path, 0, Pixel.Default, out ImageInfo info);
            Expect.Equal(8, info.Bits);
            Expect.Equal("5x3x4 U8",
                loaded.Width + "x" + loaded.Height + "x" + loaded.Channels + " " + loaded.Type);
            Expect.Same(image.Data, loaded.Data);
            Expect.Same(image.Data, Image.FromBytes(image.ToBytes()).Data);
            Expect.Same(File.ReadAllBytes(path), image.ToBytes());
        }

        [Test]
        private static void FloatsAndChannelsConvert()
        {
            float[] samples = Enumerable.Range(0, 15).Select(i => i / 15f).ToArray();
            Image image = Image.FromFloats(5, 3, 1, samples);
            Expect.Same(samples, image.ToFloats());
            Span<float> floats = image.Floats;
            floats[3] = 0.5f;
            Expect.Equal(0.5f, image.ToFloats()[3]);
            floats[3] = samples[3];
            Image back = Image.FromBytes(image.ToBytes(ImageFormat.Npy));
            Expect.Same(samples, back.ToFloats());
            Image rgba = Image.FromBytes(Gradient(1).ToBytes(), 4, Pixel.F32);
            Expect.Equal(1f, rgba.ToFloats()[3]);
            Expect.Near(4 / 255.0, rgba.ToFloats()[4], 1e-6);
            Expect.Throws<InvalidOperationException>(() => Gradient(1).ToFloats());
        }

        [Test]
        private static void StridesDescribePlanes()
        {
            var planes = new Image(5, 3, 3) { RowStride = 5, PixelStride = 1, ChannelStride = 15 };
            for (int i = 0; i < 45; ++i) planes.Data[i] = (byte)(i / 15 * 100);
            Image packed = Image.FromBytes(planes.ToBytes());
            Expect.Same(new byte[] { 0, 100, 200, 0, 100, 200 }, packed.Data.Take(6));
        }

        [Test]
        private static void AnimationsHaveFrames()
        {
            string path = Shared.PathOf("a.gif");
            Image.SaveAnimation(path, new[] { Gradient(3), Gradient(3) }, 50);
            Expect.Same(File.ReadAllBytes(path), Image.AnimationToBytes(
                new[] { Gradient(3), Gradient(3) }, 50, ImageFormat.Gif));
            Expect.Contains("fcTL", System.Text.Encoding.ASCII.GetString(
                Image.AnimationToBytes(new[] { Gradient(4), Gradient(4) }, 50, ImageFormat.Png)));
        }

        [Test]
        private static void ComparesInDoublePrecision()
        {
            var numbers = new float[3 * 12 * 12];
            Image a = Image.FromFloats(12, 12, 3, numbers);
            Image b = Image.FromFloats(12, 12, 3, numbers.Select(v => 0.1f).ToArray());
            Expect.Near(20, Image.Compare(a, b).Psnr, 1e-5);
            Expect.True(double.IsPositiveInfinity(Image.Compare(a, a).Psnr), "equal images");
            Image other = Image.FromFloats(12, 1, 3, new float[36]);
            Expect.Refused(ResultCode.ErrorShapeMismatch, "12 x 1", () => Image.Compare(a, other));
            Image cut = Image.FromFloats(12, 12, 3, new float[5]);
            Expect.Refused(ResultCode.ErrorInvalidArgument, "b.bytes", () => Image.Compare(a, cut));
        }

        [Test]
        private static void EmptyDataIsRefused()
        {
            Expect.Contains("5 x 3 pixels and 3 channels are expected, got 0 bytes",
                Expect.Throws<ArgumentException>(
                    () => new Image(5, 3, 3, Pixel.U8, new byte[0]).ToBytes()).Message);
            Expect.Throws<ArgumentException>(
                () => Image.FromFloats(5, 3, 1, default(ReadOnlySpan<float>)).ToBytes());
            Expect.Throws<ArgumentException>(() => new Image(0, 3, 3).ToBytes());
        }

        [Test]
        private static void LimitsOfDecodingHoldUntilTheyAreReplaced()
        {
            byte[] png = new Image(64, 64, 3).ToBytes();
            byte[] jpeg = File.ReadAllBytes(Path.Combine(
                Environment.GetEnvironmentVariable("SPLAT_HEADER_DIR"),
                "../tests/fuzz/corpora/jpeg/progressive"));
            byte[] tensors;
            using (Weights two = Weights.FromArrays(new[] { new NamedArray("a", new float[1], 1),
                                                            new NamedArray("b", new float[1], 1) }))
                tensors = two.ToBytes();
            Action[] reads =
            {
                () => Image.FromBytes(png), () => Image.FromBytes(jpeg),
                () => Weights.FromBytes(tensors).Dispose(),
            };
            try
            {
                Library.SetDecodeLimits(new DecodeLimits { BytesTimesFile = 1, BytesBesides = 1000 });
                Expect.Refused(ResultCode.ErrorFormat, "Library.SetDecodeLimits", reads[0]);
                Library.SetDecodeLimits(new DecodeLimits { BytesTimesFile = 1000, BytesBesides = 1000 });
                reads[0]();
                Library.SetDecodeLimits(new DecodeLimits { BytesTimesFile = 1, BytesBesides = 1 << 20 });
                reads[0]();
                Library.SetDecodeLimits(new DecodeLimits { JpegScans = 1 });
                Expect.Refused(ResultCode.ErrorFormat, "scans", reads[1]);
                Library.SetDecodeLimits(new DecodeLimits { Items = 1 });
                Expect.Refused(ResultCode.ErrorFormat, "more than 1 tensors", reads[2]);
                Expect.Throws<ArgumentOutOfRangeException>(
                    () => Library.SetDecodeLimits(new DecodeLimits { Items = -1 }));
            }
            finally
            {
                Library.SetDecodeLimits(null);
            }
            foreach (Action read in reads) read();
        }

        [Test]
        private static void RefusesBadInput()
        {
            Expect.Throws<ArgumentOutOfRangeException>(() => new Image(-1, 1, 1));
            Expect.Throws<ArgumentException>(() => new Image(1, 1, 1, Pixel.Default));
            Expect.Refused(ResultCode.ErrorOutOfHostMemory, "1048576 x 1048576 x 4",
                           () => new Image(1 << 20, 1 << 20, 4));
            Expect.Refused(ResultCode.ErrorInvalidArgument, "bytes",
                           () => new Image(5, 3, 3, Pixel.U8, new byte[44]).ToBytes());
            Expect.Refused(ResultCode.ErrorInvalidArgument, "channels", () => new Image(5, 3, 5).ToBytes());
            Expect.Refused(ResultCode.ErrorUnsupported, ".bmp",
                           () => Gradient(3).Save(Shared.PathOf("a.bmp")));
            Expect.Refused(ResultCode.ErrorNotFound, "none.png", () => Image.Load(Shared.PathOf("none.png")));
            Expect.Refused(ResultCode.ErrorFormat, "", () => Image.FromBytes(new byte[] { 1, 2, 3, 4 }));
            Expect.Refused(ResultCode.ErrorShapeMismatch, "",
                           () => Image.FromBytes(Gradient(4).ToBytes(), 3));
            Expect.Throws<ArgumentNullException>(() => Image.FromBytes(null));
            Expect.Throws<ArgumentNullException>(
                () => Image.SaveAnimation(Shared.PathOf("a.gif"), new Image[] { null }));
            Expect.Refused(ResultCode.ErrorInvalidArgument, "",
                           () => Image.SaveAnimation(Shared.PathOf("a.gif"), new Image[0]));
        }
    }
}
