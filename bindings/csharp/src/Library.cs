using System;
using System.Collections.Generic;
using System.Globalization;
using System.IO;
using System.Text.RegularExpressions;
using Splat.Interop;

namespace Splat
{
    /// <summary>
    /// What a file may cost when it is read, by this process and whatever reads it: a small file can
    /// ask for all memory or for hours. 0: the default.
    /// </summary>
    public sealed class DecodeLimits
    {
        /// <summary>Bytes of memory for each byte of the file; 0: 64.</summary>
        public long BytesTimesFile { get; set; }
        /// <summary>Bytes on top of that; 0: 64 MiB.</summary>
        public long BytesBesides { get; set; }
        /// <summary>Tensors or files of an archive; 0: 10^6.</summary>
        public long Items { get; set; }
        /// <summary>Scans of one JPEG; 0: 100.</summary>
        public int JpegScans { get; set; }
    }

    /// <summary>The loaded libsplat. The first use of any class checks that it fits.</summary>
    public static unsafe class Library
    {
        // Why reflection on this assembly is safe where programs are trimmed.
        internal const string Whole = "package/ILLink.Descriptors.xml keeps the whole assembly.";

        private const string Missing =
            "libsplat.so was not found, or a library that it needs is missing. Put its folder into " +
            "LD_LIBRARY_PATH, or name the file in Splat.dll.config (<dllmap dll=\"libsplat\" " +
            "target=\"...\"/>, mono), or take the NuGet package Libsplat (.NET), which has it for Linux and " +
            "Windows on x64 processors; for others build libsplat.";

        private const string MissingOnWindows =
            "libsplat.dll was not found. Copy libsplat's splat.dll beside the program, and call the " +
            "copy libsplat.dll: Windows ignores case, and Splat.dll is this assembly.";

        private static volatile bool fits;

        /// <summary>Version of the loaded library, "major.minor.patch".</summary>
        public static string Version
        {
            get
            {
                Ensure();
                return Text.Read(Native.splat_version_string(), -1);
            }
        }

        /// <summary>JSON: version, compiler, shaders and sizes of structs of the library.</summary>
        public static string BuildInfo
        {
            get
            {
                Ensure();
                return Text.Read(Native.splat_build_info(), -1);
            }
        }

        /// <summary>One sentence: what a result code means and what to do.</summary>
        public static string Sentence(ResultCode code)
        {
            Ensure();
            return Text.Read(Native.splat_result_sentence(code), -1);
        }

        /// <summary>Name of a result code in C, such as "SPLAT_ERROR_TIMEOUT".</summary>
        public static string NameOf(ResultCode code)
        {
            Ensure();
            return Text.Read(Native.splat_result_name(code), -1);
        }

        /// <summary>
        /// Replace the limits of this process (splat_decode_set_limits); null: the defaults. Calls
        /// that read a file then take the new ones; a file beyond them throws
        /// ResultCode.ErrorFormat. Thread-safe.
        /// </summary>
        public static void SetDecodeLimits(DecodeLimits? limits)
        {
            Ensure();
            limits = limits ?? new DecodeLimits();
            var native = new splat_decode_limits
            {
                struct_size = (uint)sizeof(splat_decode_limits),
                bytes_times_file = Check.Unsigned(limits.BytesTimesFile, nameof(limits.BytesTimesFile)),
                bytes_besides = Check.Unsigned(limits.BytesBesides, nameof(limits.BytesBesides)),
                items = Check.Unsigned(limits.Items, nameof(limits.Items)),
                jpeg_scans = Check.Unsigned(limits.JpegScans, nameof(limits.JpegScans)),
            };
            Check.Ok(Native.splat_decode_set_limits(&native));
        }

        /// <summary>
        /// Check the library. Called by every class; a program may call it first, to fail early.
        /// Throws DllNotFoundException without a library, and SplatException
        /// (ResultCode.ErrorUnsupported) for one that does not fit this assembly.
        /// </summary>
        public static void Ensure()
        {
            if (fits) return;
            string version;
            string build;
            try
            {
                version = Text.Read(Native.splat_version_string(), -1);
                build = Text.Read(Native.splat_build_info(), -1);
            }
            catch (DllNotFoundException error)
            {
                throw new DllNotFoundException(
                    (Path.DirectorySeparatorChar == '\\' ? MissingOnWindows : Missing) +
                    " The loader said: " + error.Message, error);
            }
            catch (EntryPointNotFoundException error)
            {
                throw new SplatException(
                    ResultCode.ErrorUnsupported,
                    "The libsplat that was found is not one that this assembly can use: " +
                    error.Message + ". Install libsplat " + Native.HeaderVersion + " or later.");
            }
            string? problem = Problem(version, build);
            if (problem != null)
                throw new SplatException(ResultCode.ErrorUnsupported, problem);
            fits = true;
        }

        /// <summary>A sentence on why a library does not fit, or null.</summary>
        private static string? Problem(string version, string build)
        {
            string advice =
                " Install libsplat " + Native.HeaderVersion + " or a later version with the same " +
                "first number (before 1.0 the first two), or the Splat.dll that comes with " +
                "libsplat " + version + ".";
            string both = "Splat.dll was made for libsplat " + Native.HeaderVersion +
                          ", and the loaded library is " + version;
            var header = new System.Version(Native.HeaderVersion);
            if (!System.Version.TryParse(version, out System.Version? loaded) ||
                loaded.Major != header.Major ||
                (header.Major == 0 && loaded.Minor != header.Minor) || loaded < header)
                return both + "." + advice;
            Dictionary<string, int> sizes = Sizes(build);
            foreach (NativeLayout layout in NativeLayout.All)
            {
                string name = layout.Type.Name;
                if (!sizes.TryGetValue(name, out int size))
                    return both + ", which has no struct " + name + "." + advice;
                if (layout.Frozen ? size != layout.Size : size < layout.Size)
                    return both + ", whose struct " + name + " has " + size + " bytes instead of " +
                           layout.Size + "." + advice;
            }
            return null;
        }

        /// <summary>The object "structs" of splat_build_info.</summary>
        private static Dictionary<string, int> Sizes(string build)
        {
            var sizes = new Dictionary<string, int>();
            Match structs = Regex.Match(build, "\"structs\"\\s*:\\s*\\{([^}]*)\\}");
            foreach (Match entry in Regex.Matches(structs.Groups[1].Value,
                "\"(\\w+)\"\\s*:\\s*(\\d+)"))
                sizes[entry.Groups[1].Value] =
                    int.Parse(entry.Groups[2].Value, CultureInfo.InvariantCulture);
            return sizes;
        }
    }
}
