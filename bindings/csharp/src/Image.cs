using System;
using System.Collections.Generic;
using System.IO;
using System.Runtime.InteropServices;
using Splat.Interop;

namespace Splat
{
    /// <summary>
    /// A picture in memory: the bytes of its samples, packed rows of interleaved channels unless
    /// strides say otherwise.
    /// </summary>
    public sealed unsafe class Image
    {
        /// <summary>Pixels.</summary>
        public int Width { get; }
        /// <summary>Pixels.</summary>
        public int Height { get; }
        /// <summary>1 to 4: gray, gray and alpha, RGB, RGB and alpha.</summary>
        public int Channels { get; }
        /// <summary>Type of the samples.</summary>
        public Pixel Type { get; }
        /// <summary>The samples; of a new picture 0.</summary>
        public byte[] Data { get; }
        /// <summary>Bytes from one row to the next; all strides 0: packed.</summary>
        public long RowStride { get; set; }
        /// <summary>Bytes from one pixel to the next.</summary>
        public long PixelStride { get; set; }
        /// <summary>Bytes from one channel to the next.</summary>
        public long ChannelStride { get; set; }

        /// <summary>
        /// Make a picture. `data` is not copied; null: a new array. The library checks its length
        /// when it uses the picture; without a byte it is an ArgumentException.
        /// </summary>
        public Image(int width, int height, int channels, Pixel type = Pixel.U8, byte[]? data = null)
        {
            int bytes = SampleBytes(type);
            Width = (int)Check.Unsigned(width, nameof(width));
            Height = (int)Check.Unsigned(height, nameof(height));
            Channels = (int)Check.Unsigned(channels, nameof(channels));
            Type = type;
            Data = data ?? Values.New<byte>("the samples", width, height, channels, bytes);
            if (Data.Length == 0)  // the library would trust a size of 0
                throw new ArgumentException(
                    "samples of an image of " + width + " x " + height + " pixels and " + channels +
                    " channels are expected, got 0 bytes", nameof(data));
        }

        /// <summary>Make a picture of a copy of float samples, row by row, channels interleaved.</summary>
        public static Image FromFloats(int width, int height, int channels,
            ReadOnlySpan<float> samples) =>
            new Image(width, height, channels, Pixel.F32,
                      MemoryMarshal.AsBytes(samples).ToArray());

        /// <summary>The samples of a Pixel.F32 picture in a new array.</summary>
        public float[] ToFloats() => Floats.ToArray();

        /// <summary>The samples of a Pixel.F32 picture in place.</summary>
        public Span<float> Floats =>
            Type == Pixel.F32 ? MemoryMarshal.Cast<byte, float>(Data)
                : throw new InvalidOperationException("the samples are " + Type + ", not F32");

        /// <summary>Read PNG, JPEG, WebP or .npy.</summary>
        /// <param name="path">of the file</param>
        /// <param name="channels">0: as in the file</param>
        /// <param name="type">Default: U8, or F32 for files of more than 8 bits</param>
        public static Image Load(string path, int channels = 0, Pixel type = Pixel.Default) =>
            Load(path, channels, type, out ImageInfo _);

        /// <summary>The same, with bits and focal length of the file.</summary>
        public static Image Load(string path, int channels, Pixel type, out ImageInfo info)
        {
            using (var arena = new Arena())
            {
                byte* name = arena.Text(path, nameof(path));
                return Read((image, about) => Native.splat_image_load(name, image, about), channels,
                            type, out info);
            }
        }

        /// <summary>Read the bytes of such a file.</summary>
        public static Image FromBytes(ReadOnlyMemory<byte> file, int channels = 0, Pixel type = Pixel.Default) =>
            FromBytes(file, channels, type, out ImageInfo _);

        /// <summary>Read the rest of a stream of such bytes.</summary>
        public static Image FromStream(Stream stream, int channels = 0, Pixel type = Pixel.Default) =>
            FromBytes(Values.ReadAll(stream, nameof(stream)), channels, type);

        /// <summary>The same, with bits and focal length of the file.</summary>
        public static Image FromBytes(ReadOnlyMemory<byte> file, int channels, Pixel type, out ImageInfo info)
        {
            using (var arena = new Arena())
            {
                void* data = arena.Pin(Check.NotNull(file, nameof(file)));
                return Read((image, about) => Native.splat_image_load_memory(
                                data, (UIntPtr)file.Length, image, about),
                            channels, type, out info);
            }
        }

        private delegate ResultCode ReadCall(splat_image* image, splat_image_info* info);

        private static Image Read(ReadCall call, int channels, Pixel type, out ImageInfo info)
        {
            Check.Unsigned(channels, nameof(channels));
            var native = new splat_image { type = type };
            var about = new splat_image_info { struct_size = (uint)sizeof(splat_image_info) };
            Check.Ok(call(&native, &about));
            var image = new Image((int)native.width, (int)native.height,
                                  channels == 0 ? (int)native.channels : channels, native.type);
            using (var arena = new Arena())
            {
                native = image.ToNative(arena);
                Check.Ok(call(&native, &about));
            }
            info = new ImageInfo(&about);
            return image;
        }

        /// <summary>Write .png or .npy, whole or not at all.</summary>
        public void Save(string path)
        {
            using (var arena = new Arena())
            {
                splat_image native = ToNative(arena);
                Check.Ok(Native.splat_image_save(arena.Text(path, nameof(path)), &native));
            }
        }

        /// <summary>The bytes of such a file.</summary>
        public byte[] ToBytes(ImageFormat format = ImageFormat.Png)
        {
            using (var arena = new Arena())
            {
                splat_image native = ToNative(arena);
                return Text.GetBytes((buffer, capacity, needed) =>
                {
                    splat_image copy = native;
                    return Native.splat_image_save_memory(&copy, format, buffer, capacity, needed);
                });
            }
        }

        /// <summary>Write pictures of one size as an animation, .png, .gif or .webp.</summary>
        public static void SaveAnimation(string path, IReadOnlyList<Image> frames,
                                         int milliseconds = 40)
        {
            using (var arena = new Arena())
            {
                splat_image[] natives = ToNative(frames, nameof(frames), arena);
                Check.Ok(Native.splat_image_save_animation(
                    arena.Text(path, nameof(path)), (splat_image*)arena.Pin(natives),
                    (uint)natives.Length, Check.Unsigned(milliseconds, nameof(milliseconds))));
            }
        }

        /// <summary>The bytes of such a file.</summary>
        public static byte[] AnimationToBytes(IReadOnlyList<Image> frames, int milliseconds,
                                              ImageFormat format)
        {
            using (var arena = new Arena())
            {
                splat_image[] natives = ToNative(frames, nameof(frames), arena);
                var first = (splat_image*)arena.Pin(natives);
                uint time = Check.Unsigned(milliseconds, nameof(milliseconds));
                return Text.GetBytes((buffer, capacity, needed) =>
                    Native.splat_image_save_animation_memory(first, (uint)natives.Length, time,
                                                             format, buffer, capacity, needed));
            }
        }

        /// <summary>PSNR and SSIM of two images of one size; alpha counts as any other channel.</summary>
        public static ImageScores Compare(Image a, Image b)
        {
            using (var arena = new Arena())
            {
                splat_image first = Check.NotNull(a, nameof(a)).ToNative(arena);
                splat_image second = Check.NotNull(b, nameof(b)).ToNative(arena);
                var scores = new splat_image_scores { struct_size = (uint)sizeof(splat_image_scores) };
                Check.Ok(Native.splat_image_compare(&first, &second, &scores));
                return new ImageScores(&scores);
            }
        }

        /// <summary>Size and type.</summary>
        public override string ToString() =>
            "Image (" + Width + " x " + Height + ", " + Channels + " channels of " + Type + ")";

        internal splat_image ToNative(Arena arena)
        {
            return new splat_image
            {
                pixels = arena.Pin(Data),
                bytes = (UIntPtr)Data.Length,
                type = Type,
                width = (uint)Width,
                height = (uint)Height,
                channels = (uint)Channels,
                row_stride = RowStride,
                pixel_stride = PixelStride,
                channel_stride = ChannelStride,
            };
        }

        internal static splat_image[] ToNative(IReadOnlyList<Image> images, string name, Arena arena)
        {
            Check.NotNull(images, name);
            var natives = new splat_image[images.Count];
            for (int i = 0; i < natives.Length; ++i)
                natives[i] = Check.NotNull(images[i], name + "[" + i + "]").ToNative(arena);
            return natives;
        }

        private static int SampleBytes(Pixel type)
        {
            switch (type)
            {
                case Pixel.U8: return 1;
                case Pixel.F16: return 2;
                case Pixel.F32: return 4;
                default:
                    throw new ArgumentException("samples are U8, F16 or F32, not " + type,
                                                nameof(type));
            }
        }
    }

    /// <summary>
    /// Learned perceptual image patch similarity (VGG16) for images of one size, on a device. The
    /// caller synchronises calls on one object.
    /// </summary>
    public sealed unsafe class Lpips : NativeObject<SafeLpipsHandle>
    {
        /// <summary>Create the network.</summary>
        /// <param name="device">where it runs</param>
        /// <param name="weights">of torchvision's vgg16 and of the lpips package: one or
        /// two</param>
        /// <param name="side">pixels of the images, both ways; 16 or more</param>
        public Lpips(Device device, IReadOnlyList<Weights> weights, int side)
            : base(Create(device, weights, side))
        {
        }

        private static SafeLpipsHandle Create(Device device, IReadOnlyList<Weights> weights,
            int side)
        {
            Check.NotNull(device, nameof(device));
            Check.NotNull(weights, nameof(weights));
            using (var arena = new Arena())
            {
                var desc = new splat_lpips_desc
                {
                    struct_size = (uint)sizeof(splat_lpips_desc),
                    weights = arena.HoldAll(weights, nameof(weights)),
                    weight_count = (uint)weights.Count,
                    side = Check.Unsigned(side, nameof(side)),
                };
                IntPtr handle;
                Check.Ok(Native.splat_lpips_create(device.Handle, &desc, &handle));
                return new SafeLpipsHandle(handle, true);
            }
        }

        /// <summary>Distance of two RGB images of `side` x `side` pixels; equal images have 0.</summary>
        public double Compare(Image a, Image b)
        {
            using (var arena = new Arena())
            {
                splat_image first = Check.NotNull(a, nameof(a)).ToNative(arena);
                splat_image second = Check.NotNull(b, nameof(b)).ToNative(arena);
                double value;
                Check.Ok(Native.splat_lpips_compare(Handle, &first, &second, &value));
                return value;
            }
        }
    }
}
