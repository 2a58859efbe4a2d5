using System;
using System.Collections.Generic;
using System.Linq;
using System.Reflection;
using System.Text.RegularExpressions;

namespace Splat.Tests
{
    /// <summary>Marks a static method without parameters as a test.</summary>
    [AttributeUsage(AttributeTargets.Method)]
    internal sealed class TestAttribute : Attribute
    {
    }

    /// <summary>What a test expects; the message names both values.</summary>
    internal static class Expect
    {
        internal static void True(bool condition, string what)
        {
            if (!condition) throw new InvalidOperationException("expected: " + what);
        }

        internal static void Equal<T>(T expected, T actual)
        {
            if (!EqualityComparer<T>.Default.Equals(expected, actual))
                throw new InvalidOperationException("expected " + expected + ", got " + actual);
        }

        internal static void Same<T>(IEnumerable<T> expected, IEnumerable<T> actual)
        {
            T[] a = expected.ToArray();
            T[] b = actual.ToArray();
            if (!a.SequenceEqual(b))
                throw new InvalidOperationException("expected " + Some(a) + ", got " + Some(b));
        }

        private static string Some<T>(T[] values)
        {
            return values.Length + " [" + string.Join(", ", values.Take(8)) + "]";
        }

        internal static void Near(double expected, double actual, double tolerance)
        {
            if (!(Math.Abs(expected - actual) <= tolerance))
                throw new InvalidOperationException("expected " + expected + " within " + tolerance +
                                                    ", got " + actual);
        }

        internal static void Contains(string part, string text)
        {
            if (text == null || text.IndexOf(part, StringComparison.Ordinal) < 0)
                throw new InvalidOperationException("expected a text with \"" + part + "\", got \"" +
                                                    text + "\"");
        }

        /// <summary>The exception of exactly that type; any other outcome fails.</summary>
        internal static T Throws<T>(Action action) where T : Exception
        {
            try
            {
                action();
            }
            catch (Exception error)
            {
                if (error.GetType() == typeof(T)) return (T)error;
                throw new InvalidOperationException(
                    "expected " + typeof(T).Name + ", got " + error.GetType().Name, error);
            }
            throw new InvalidOperationException("expected " + typeof(T).Name + ", got no exception");
        }

        /// <summary>A SplatException of that code, whose text contains `part`.</summary>
        internal static void Refused(ResultCode code, string part, Action action)
        {
            SplatException error = Throws<SplatException>(action);
            Equal(code, error.Code);
            Contains(part, error.Message);
            string own = Regex.Replace(error.Message, "(?<!\\w)'[^']*'", "");  // without the caller's words
            True(!Regex.IsMatch(own, "\\bsplat_[a-z]|\\bSPLAT_(ERROR|RASTERIZER|MODEL|WEIGHTS|PORT)"),
                 "no names of C: " + error.Message);
        }
    }

    /// <summary>Runs the tests of one class, or of all.</summary>
    internal static class Runner
    {
        private static int Main(string[] arguments)
        {
            string name = arguments.Length == 0 ? "" : arguments[0];
            if (Programs.Has(name)) return Programs.Run(name, arguments.Skip(1).ToArray());
            int done = 0;
            int failed = 0;
            foreach (Type type in Assembly.GetExecutingAssembly().GetTypes().OrderBy(t => t.Name))
                foreach (MethodInfo test in type.GetMethods(BindingFlags.Static |
                                                            BindingFlags.NonPublic))
                {
                    if (test.GetCustomAttribute<TestAttribute>() == null) continue;
                    if (name != "" && type.Name != name + "Tests") continue;
                    ++done;
                    if (!Passes(type, test)) ++failed;
                }
            Shared.Close();
            Console.WriteLine(done + " tests, " + failed + " failed");
            return done == 0 || failed > 0 ? 1 : 0;
        }

        private static bool Passes(Type type, MethodInfo test)
        {
            string title = type.Name + "." + test.Name;
            var clock = System.Diagnostics.Stopwatch.StartNew();
            try
            {
                ((Action)Delegate.CreateDelegate(typeof(Action), test))();
                Console.WriteLine("ok    " + title + " (" + clock.ElapsedMilliseconds + " ms)");
                return true;
            }
            catch (Exception error)
            {
                Console.WriteLine("FAIL  " + title + "\n" + error);
                return false;
            }
        }
    }
}
