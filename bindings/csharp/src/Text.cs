using System;
using System.Collections.Generic;
using System.IO;
using System.Runtime.InteropServices;
using System.Text;
using Splat.Interop;

namespace Splat
{
    /// <summary>UTF-8 texts of the library, and results that it writes to a buffer.</summary>
    internal static unsafe class Text
    {
        private static readonly UTF8Encoding Strict = new UTF8Encoding(false, true);
        private static readonly UTF8Encoding Lenient = new UTF8Encoding(false, false);

        /// <summary>A function of the library that writes text to a buffer.</summary>
        internal delegate ResultCode TextCall(byte* buffer, UIntPtr capacity, UIntPtr* needed);

        /// <summary>A function of the library that writes the bytes of a file.</summary>
        internal delegate ResultCode BytesCall(void* buffer, UIntPtr capacity, UIntPtr* needed);

        /// <summary>Text up to its NUL; null for NULL.</summary>
        internal static string? Optional(byte* text) => text == null ? null : Read(text, -1);

        /// <summary>Text up to its NUL and at most `capacity` bytes (-1: no limit); "" for NULL.</summary>
        internal static string Read(byte* text, int capacity)
        {
            if (text == null) return "";
            int length = 0;
            while (length != capacity && text[length] != 0) ++length;
            return Lenient.GetString(text, length);
        }

        /// <summary>
        /// UTF-8 bytes with a NUL. Throws ArgumentException for a text with a NUL inside, or with
        /// half of a surrogate pair.
        /// </summary>
        internal static byte[] Bytes(string text, string name)
        {
            if (text.IndexOf('\0') >= 0)
                throw new ArgumentException("a text with a NUL character inside: \"" +
                                            text.Replace("\0", "\\0") + "\"", name);
            try
            {
                var bytes = new byte[Strict.GetByteCount(text) + 1];
                Strict.GetBytes(text, 0, text.Length, bytes, 0);
                return bytes;
            }
            catch (EncoderFallbackException error)
            {
                throw new ArgumentException(
                    "a text with half of a surrogate pair at index " + error.Index, name, error);
            }
        }

        /// <summary>Call once for the size and once for the text.</summary>
        internal static string Get(TextCall call)
        {
            byte[] bytes = GetBytes((buffer, capacity, needed) => call((byte*)buffer, capacity, needed));
            return Lenient.GetString(bytes, 0, Math.Max(bytes.Length - 1, 0));
        }

        /// <summary>A function of the library that writes a text about an object.</summary>
        internal delegate ResultCode AboutCall<T>(T handle, byte* buffer, UIntPtr capacity, UIntPtr* needed);

        internal static string Get<T>(T handle, AboutCall<T> call) =>
            Get((buffer, capacity, needed) => call(handle, buffer, capacity, needed));

        /// <summary>Call for the size and for the bytes, again if there are more by then.</summary>
        internal static byte[] GetBytes(BytesCall call)
        {
            Library.Ensure();
            var bytes = Array.Empty<byte>();
            while (true)
            {
                UIntPtr needed = UIntPtr.Zero;
                ResultCode code;
                fixed (byte* buffer = bytes)
                    code = call(buffer, (UIntPtr)bytes.Length, &needed);
                Check.Ok(code);
                if (code != ResultCode.Incomplete)
                {
                    Array.Resize(ref bytes, (int)needed);
                    return bytes;
                }
                bytes = Values.New<byte>("the bytes", checked((long)needed));
            }
        }
    }

    /// <summary>Arrays of numbers, new ones and copies of what the library holds.</summary>
    internal static unsafe class Values
    {
        /// <summary>
        /// A new array whose length is a product, which is refused by a sentence where it does not
        /// fit into memory.
        /// </summary>
        internal static T[] New<T>(string what, params long[] counts)
        {
            try
            {
                long length = 1;
                foreach (long count in counts) length = checked(length * count);
                return new T[checked((int)length)];
            }
            catch (Exception error) when (error is OverflowException || error is OutOfMemoryException)
            {
                throw new SplatException(
                    ResultCode.ErrorOutOfHostMemory, "there is no memory for " + what + ", an array of " +
                    string.Join(" x ", counts) + " elements", error);
            }
        }

        /// <summary>A function of the library that reads or writes the numbers of a name.</summary>
        internal delegate ResultCode NamedCall<T>(T handle, byte* name, float* values, UIntPtr bytes);

        /// <summary>Call one; the library names the sizes where there are no numbers.</summary>
        internal static void Move<T>(T handle, string name, ReadOnlySpan<float> values, NamedCall<T> call)
        {
            using (var arena = new Arena())
                fixed (float* data = &MemoryMarshal.GetReference(values))
                {
                    float none;
                    Check.Ok(call(handle, arena.Text(name, nameof(name)), data == null ? &none : data,
                                  (UIntPtr)((ulong)values.Length * sizeof(float))));
                }
        }

        /// <summary>What is left of a stream.</summary>
        internal static byte[] ReadAll(Stream stream, string name)
        {
            using (var bytes = new MemoryStream())
            {
                Check.NotNull(stream, name).CopyTo(bytes);
                return bytes.ToArray();
            }
        }

        internal static float[] Copy(float* from, int count) =>
            new ReadOnlySpan<float>(from, count).ToArray();

        internal static IReadOnlyList<T> List<T>(void* from, int count) =>
            Array.AsReadOnly(new ReadOnlySpan<T>(from, count).ToArray());
    }
}
