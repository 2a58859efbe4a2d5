using System;
using System.Collections.Generic;
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

        /// <summary>
        /// Text up to its NUL and at most `capacity` bytes (-1: no limit); null for NULL.
        /// </summary>
        internal static string Read(byte* text, int capacity)
        {
            if (text == null) return null;
            int length = 0;
            while (length != capacity && text[length] != 0) ++length;
            return Lenient.GetString(text, length);
        }

        /// <summary>
        /// UTF-8 bytes with a NUL. Throws ArgumentException for a text with a NUL inside, or with
        /// half of a surrogate pair.
        /// </summary>
        internal static byte[] Bytes(string text)
        {
            if (text.IndexOf('\0') >= 0)
                throw new ArgumentException("a text with a NUL character inside: \"" +
                                            text.Replace("\0", "\\0") + "\"");
            try
            {
                var bytes = new byte[Strict.GetByteCount(text) + 1];
                Strict.GetBytes(text, 0, text.Length, bytes, 0);
                return bytes;
            }
            catch (EncoderFallbackException error)
            {
                throw new ArgumentException(
                    "a text with half of a surrogate pair at index " + error.Index, error);
            }
        }

        /// <summary>Call once for the size and once for the text.</summary>
        internal static string Get(TextCall call)
        {
            byte[] bytes = GetBytes((buffer, capacity, needed) =>
                call((byte*)buffer, capacity, needed));
            return Lenient.GetString(bytes, 0, Math.Max(bytes.Length - 1, 0));
        }

        /// <summary>Call for the size and for the bytes, again if there are more by then.</summary>
        internal static byte[] GetBytes(BytesCall call)
        {
            Library.Ensure();
            var bytes = new byte[0];
            while (true)
            {
                UIntPtr needed = UIntPtr.Zero;
                ResultCode code;
                fixed (byte* buffer = bytes)
                    code = call(buffer, (UIntPtr)bytes.Length, &needed);
                Check.Ok(code);
                if (code != ResultCode.Incomplete)
                {
                    Array.Resize(ref bytes, checked((int)needed.ToUInt64()));
                    return bytes;
                }
                bytes = new byte[checked((int)needed.ToUInt64())];
            }
        }
    }

    /// <summary>Copies of numbers that the library holds.</summary>
    internal static unsafe class Values
    {
        internal static IReadOnlyList<T> List<T>(void* from, int count)
        {
            return Array.AsReadOnly(new ReadOnlySpan<T>(from, count).ToArray());
        }

        internal static long[] Copy(long* from, int count)
        {
            return new ReadOnlySpan<long>(from, count).ToArray();
        }

        internal static float[] Copy(float* from, int count)
        {
            return new ReadOnlySpan<float>(from, count).ToArray();
        }

        internal static double[] Copy(double* from, int count)
        {
            return new ReadOnlySpan<double>(from, count).ToArray();
        }
    }
}
