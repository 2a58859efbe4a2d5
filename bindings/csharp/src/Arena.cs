using System;
using System.Buffers;
using System.Collections.Generic;
using System.Runtime.InteropServices;

namespace Splat
{
    /// <summary>
    /// What one call of the library needs to stay in place: texts, pinned arrays, and handles that
    /// must not be destroyed meanwhile.
    /// </summary>
    internal sealed unsafe class Arena : IDisposable
    {
        private readonly List<MemoryHandle> pins = new List<MemoryHandle>();
        private readonly List<SafeHandle> held = new List<SafeHandle>();

        internal Arena()
        {
            Library.Ensure();
        }

        /// <summary>NUL-terminated UTF-8; NULL for null. `name` is that of the argument.</summary>
        internal byte* Optional(string? text, string name) => text == null ? null : Text(text, name);

        /// <summary>The same of an argument that must be there.</summary>
        internal byte* Text(string? text, string name) =>
            (byte*)Pin(Splat.Text.Bytes(Check.NotNull(text, name), name));

        /// <summary>An array of such texts; NULL for null. `name` is that of the argument.</summary>
        internal byte** Texts(IReadOnlyList<string>? texts, string name)
        {
            if (texts == null) return null;
            var pointers = new IntPtr[texts.Count];
            for (int i = 0; i < pointers.Length; ++i)
                pointers[i] = (IntPtr)Text(texts[i], name + "[" + i + "]");
            return (byte**)Pin(pointers);
        }

        /// <summary>The elements of an array; NULL for null.</summary>
        internal void* Pin(Array? array)
        {
            if (array == null) return null;
            GCHandle pin = GCHandle.Alloc(array, GCHandleType.Pinned);
            pins.Add(new MemoryHandle((void*)pin.AddrOfPinnedObject(), pin));
            return pins[pins.Count - 1].Pointer;
        }

        /// <summary>Memory of the caller; NULL for null.</summary>
        internal void* Pin<T>(ReadOnlyMemory<T> memory)
        {
            pins.Add(memory.Pin());
            return pins[pins.Count - 1].Pointer;
        }

        /// <summary>The handle of an object, kept until the end of the call; NULL for null.</summary>
        internal IntPtr Hold<T>(NativeObject<T>? item) where T : SafeHandle
        {
            if (item == null) return IntPtr.Zero;
            T handle = item.Handle;
            bool added = false;
            handle.DangerousAddRef(ref added);
            held.Add(handle);
            return handle.DangerousGetHandle();
        }

        /// <summary>Handles of several objects; NULL for null. With a name, none of them is null.</summary>
        internal IntPtr* HoldAll<T>(IReadOnlyList<NativeObject<T>>? items, string? name = null) where T : SafeHandle
        {
            if (items == null) return null;
            var handles = new IntPtr[items.Count];
            for (int i = 0; i < handles.Length; ++i)
                handles[i] = Hold(name == null ? items[i] : Check.NotNull(items[i], name + "[" + i + "]"));
            return (IntPtr*)Pin(handles);
        }

        public void Dispose()
        {
            foreach (MemoryHandle pin in pins) pin.Dispose();
            foreach (SafeHandle handle in held) handle.DangerousRelease();
        }
    }
}
