using System;
using System.Linq;
using System.Reflection;
using System.Runtime.InteropServices;
using Splat.Interop;

namespace Splat.Tests
{
    internal static class LayoutTests
    {
        [Test]
        private static void StructsAreAsInTheHeaders()
        {
            Expect.True(NativeLayout.All.Length > 50, "all structs");
            foreach (NativeLayout layout in NativeLayout.All)
            {
                string name = layout.Type.Name;
                Expect.Equal(name + " " + layout.Size, name + " " + Marshal.SizeOf(layout.Type));
                FieldInfo[] fields = layout.Type.GetFields(BindingFlags.Instance | BindingFlags.Public);
                Expect.Equal(name + " " + layout.Fields.Length, name + " " + fields.Length);
                foreach (FieldInfo field in fields)
                {
                    string found = field.Name + ":" + Marshal.OffsetOf(layout.Type, field.Name) +
                                   ":" + SizeOf(field);
                    Expect.True(layout.Fields.Contains(found),
                                name + " as in the headers, not with " + found);
                }
            }
        }

        private static int SizeOf(FieldInfo field)
        {
            Type type = field.FieldType;
            if (type.IsPointer) return IntPtr.Size;
            return Marshal.SizeOf(type.IsEnum ? Enum.GetUnderlyingType(type) : type);
        }

        [Test]
        private static void EveryFunctionIsInTheLibrary()
        {
            MethodInfo[] functions = typeof(Native)
                .GetMethods(BindingFlags.Static | BindingFlags.Public)
                .Where(m => (m.Attributes & MethodAttributes.PinvokeImpl) != 0).ToArray();
            Expect.True(functions.Length > 150, "all functions");
            foreach (MethodInfo function in functions) Marshal.Prelink(function);
        }

        [Test]
        private static void LibraryTellsItsVersion()
        {
            Expect.Equal(Native.HeaderVersion, Library.Version);
            Expect.Equal(Native.HeaderVersion,
                         Native.SPLAT_VERSION_MAJOR + "." + Native.SPLAT_VERSION_MINOR + "." +
                         Native.SPLAT_VERSION_PATCH);
            Expect.Contains("\"compiler\"", Library.BuildInfo);
            Expect.Equal("SPLAT_ERROR_TIMEOUT", Library.NameOf(ResultCode.ErrorTimeout));
            Expect.True(Library.Sentence(ResultCode.ErrorTimeout).Length > 10, "a sentence");
        }

        [Test]
        private static void EveryHandleKindHasAClass()
        {
            Type[] types = typeof(Device).Assembly.GetTypes();
            foreach (Type handle in types.Where(t => t.Namespace == "Splat.Interop" &&
                                                     typeof(SafeHandle).IsAssignableFrom(t)))
                Expect.True(types.Any(t => t.BaseType != null && t.BaseType.IsGenericType &&
                                           t.BaseType.GetGenericTypeDefinition() == typeof(NativeObject<>) &&
                                           t.BaseType.GetGenericArguments()[0] == handle),
                            "a class over " + handle.Name);
        }
    }
}
