using System;
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
        private readonly List<GCHandle> pins = new List<GCHandle>();
        private readonly List<SafeHandle> held = new List<SafeHandle>();

        internal Arena()
        {
            Library.Ensure();
        }

        /// <summary>NUL-terminated UTF-8; NULL for null.</summary>
        internal byte* Text(string text)
        {
            return text == null ? null : (byte*)Pin(Splat.Text.Bytes(text));
        }

        /// <summary>An array of such texts; NULL for null.</summary>
        internal byte** Texts(IReadOnlyList<string> texts)
        {
            if (texts == null) return null;
            var pointers = new IntPtr[texts.Count];
            for (int i = 0; i < pointers.Length; ++i)
                pointers[i] = (IntPtr)Text(Check.NotNull(texts[i], "texts[" + i + "]"));
            return (byte**)Pin(pointers);
        }

        /// <summary>The elements of an array; NULL for null.</summary>
        internal void* Pin(Array array)
        {
            if (array == null) return null;
            GCHandle pin = GCHandle.Alloc(array, GCHandleType.Pinned);
            pins.Add(pin);
            return (void*)pin.AddrOfPinnedObject();
        }

        /// <summary>The handle of an object, kept until the end of the call; NULL for
        /// null.</summary>
        internal IntPtr Hold<T>(NativeObject<T> item) where T : SafeHandle
        {
            if (item == null) return IntPtr.Zero;
            T handle = item.Handle;
            bool added = false;
            handle.DangerousAddRef(ref added);
            held.Add(handle);
            return handle.DangerousGetHandle();
        }

        /// <summary>Handles of several objects; NULL for null.</summary>
        internal IntPtr* HoldAll<T>(IReadOnlyList<NativeObject<T>> items) where T : SafeHandle
        {
            if (items == null) return null;
            var handles = new IntPtr[items.Count];
            for (int i = 0; i < handles.Length; ++i) handles[i] = Hold(items[i]);
            return (IntPtr*)Pin(handles);
        }

        public void Dispose()
        {
            foreach (GCHandle pin in pins) pin.Free();
            foreach (SafeHandle handle in held) handle.DangerousRelease();
            pins.Clear();
            held.Clear();
        }
    }
}
