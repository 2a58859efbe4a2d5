using System;
using System.Collections.Generic;
using System.Linq;
using System.Reflection;
using System.Text.RegularExpressions;
using System.Threading;
using Splat.Interop;

namespace Splat
{
    /// <summary>An error of the library: its code, and its text as the message.</summary>
    public class SplatException : Exception
    {
        /// <summary>What kind of error; negative numbers.</summary>
        public ResultCode Code { get; }

        /// <summary>Make an exception of a code, a text and what caused it.</summary>
        public SplatException(ResultCode code, string message, Exception? inner = null)
            : base(message, inner)
        {
            Code = code;
        }
    }

#if NET8_0_OR_GREATER
    [System.Diagnostics.CodeAnalysis.UnconditionalSuppressMessage("Trimming", "IL2026", Justification = Library.Whole)]
    [System.Diagnostics.CodeAnalysis.UnconditionalSuppressMessage("Trimming", "IL2057", Justification = Library.Whole)]
    [System.Diagnostics.CodeAnalysis.UnconditionalSuppressMessage("Trimming", "IL2070", Justification = Library.Whole)]
    [System.Diagnostics.CodeAnalysis.UnconditionalSuppressMessage("Trimming", "IL2075", Justification = Library.Whole)]
#endif
    internal static partial class OwnWords
    {
        private static readonly Regex Name = new Regex(
            "(?<!\\w)'.*?'(?!\\w)|(?<![\\w/.])((?:splat|SPLAT)_\\w+|NULL\\b|desc(?=\\.))(\\.(?=[a-z])|(?<=_)\\*)?|" +
            "(?<![\\w/])((?!splat)[a-z]+_\\w+)|^(bytes)(?= is )");
        // "linear: name is ..." has an attribute of an operator, which JSON names.
        private static readonly Regex Argument =
            new Regex("(?<!\\w)'.*?'(?!\\w)|^[a-z]\\w*: [a-z]\\w* (?=is |are |has )|" +
                      "(?<![\\w/\"]|\\w\\.|, )([a-z]\\w*_\\w+)(?![\\w,:.\"])");
        private static readonly Lazy<HashSet<string>> Own = new Lazy<HashSet<string>>(() =>
        {
            Type[] types = typeof(OwnWords).Assembly.GetExportedTypes();
            IEnumerable<ParameterInfo> given = types.SelectMany(t => t.GetMethods().Cast<MethodBase>()
                .Concat(t.GetConstructors())).SelectMany(m => m.GetParameters());
            return new HashSet<string>(types.SelectMany(t => t.GetProperties()).Select(p => p.Name)
                .Concat(given.Select(p => p.Name ?? "")));
        });

        /// <summary>
        /// A message of the library with the words of C# for the names of its headers. Fields of
        /// structs are options and arguments here: "flags" for "splat_scene_desc.flags".
        /// What stands in quotes is the caller's.
        /// </summary>
        internal static string In(string message)
        {
            string named = Name.Replace(message, found =>
            {
                string name = found.Groups[1].Value + found.Groups[3].Value + found.Groups[4].Value;
                if (found.Groups[2].Value == ".") return "";
                if (Of.TryGetValue(name, out string? word)) return word;
                if (Type.GetType("Splat.Interop." + name) == null) return found.Value;
                string made = name.Replace("_desc", "");
                return Of.TryGetValue(made, out word) ? word : Pascal(made.Substring(6));
            });
            return Argument.Replace(named, found =>
            {
                string name = found.Groups[1].Value;
                bool gradient = typeof(splat_gradients_desc).GetField(name) != null;  // without "grad_"
                string property = Pascal(gradient ? name.Substring(5) : name);
                if (name == "" || Own.Value.Contains(property)) return name == "" ? found.Value : property;
                string argument = char.ToLowerInvariant(property[0]) + property.Substring(1);
                return Own.Value.Contains(argument) ? argument : name;
            });
        }

        private static string Pascal(string name)
        {
            return Regex.Replace(name, "(?:^|_+)([a-z])|_", start => start.Groups[1].Value.ToUpperInvariant());
        }
    }

    /// <summary>Tells analyzers that a parameter is not null afterwards.</summary>
    [AttributeUsage(AttributeTargets.Parameter)]
    internal sealed class ValidatedNotNullAttribute : Attribute
    {
    }

    /// <summary>Turns results of the library into exceptions.</summary>
    internal static unsafe class Check
    {
        /// <summary>
        /// Throw for an error; the text is that of the last error of this thread.
        /// ResultCode.Cancelled is an OperationCanceledException, with `token` if it was that
        /// token that cancelled.
        /// </summary>
        internal static void Ok(ResultCode code,
                                CancellationToken token = default(CancellationToken))
        {
            if (code >= 0) return;
            var error = new SplatException(
                code, OwnWords.In(Text.Read(Native.splat_last_error_message(), -1)));
            if (code != ResultCode.Cancelled) throw error;
            throw new OperationCanceledException(
                error.Message, error,
                token.IsCancellationRequested ? token : CancellationToken.None);
        }

        /// <summary>A function of the library that makes an object of another.</summary>
        internal delegate ResultCode MakeCall<T>(T handle, IntPtr* made);

        internal static IntPtr Made<T>(T handle, MakeCall<T> call)
        {
            IntPtr made;
            Ok(call(handle, &made));
            return made;
        }

        /// <summary>Throw unless `argument` is there.</summary>
        internal static T NotNull<T>([ValidatedNotNull] T? argument, string name) where T : class
        {
            return argument ?? throw new ArgumentNullException(name);
        }

        /// <summary>Throw for the memory of a null array.</summary>
        internal static ReadOnlyMemory<T> NotNull<T>(ReadOnlyMemory<T> argument, string name)
        {
            if (!argument.Equals(default(ReadOnlyMemory<T>))) return argument;
            throw new ArgumentNullException(name, "null, or ReadOnlyMemory.Empty, which is the same");
        }

        /// <summary>A count of the caller as an unsigned number.</summary>
        internal static uint Unsigned(int value, string name) => (uint)Unsigned((long)value, name);

        internal static ulong Unsigned(long value, string name)
        {
            if (value < 0)
                throw new ArgumentOutOfRangeException(name, value, "a number of 0 or more is needed");
            return (ulong)value;
        }

        /// <summary>A number of the caller between two others.</summary>
        internal static long Within(long value, long low, long high, string name)
        {
            if (value >= low && value <= high) return value;
            throw new ArgumentOutOfRangeException(name, value, "not within " + low + " to " + high);
        }

        /// <summary>A mistake in an argument.</summary>
        internal static ArgumentException Bad(string sentence, string name) => new ArgumentException(sentence, name);

        /// <summary>A copy of a shape, of no more dimensions than there may be.</summary>
        internal static IReadOnlyList<long> Dims(long[] dims, string name)
        {
            if (NotNull(dims, name).Length <= Native.SPLAT_MAX_RANK) return Array.AsReadOnly((long[])dims.Clone());
            throw new ArgumentException(
                dims.Length + " dimensions; the most are " + Native.SPLAT_MAX_RANK, name);
        }

        /// <summary>Numbers of the caller, as many as `count`.</summary>
        internal static ReadOnlySpan<T> Numbers<T>(ReadOnlySpan<T> values, int count, string name)
        {
            if (values.Length == count) return values;
            throw new ArgumentException(values.Length + " numbers instead of " + count, name);
        }
    }
}
