using System;
using System.Runtime.InteropServices;
using System.Threading;
using Splat.Interop;

namespace Splat
{
    /// <summary>
    /// An object of the library. Dispose it when it is no longer needed; one that is not disposed
    /// is released when the collector finds it. Objects may be disposed in any order, and while
    /// another thread computes with them: the memory is then freed at the end of that call.
    /// A member of a disposed object throws ObjectDisposedException.
    /// </summary>
    public abstract class NativeObject<T> : IDisposable where T : SafeHandle
    {
        private readonly T handle;
        // A handle that a call still uses is closed at the end of that call only.
        private volatile bool disposed;

        // Other assemblies cannot derive from this class.
        internal NativeObject(T handle)
        {
            this.handle = handle;
        }

        /// <summary>True after Dispose.</summary>
        public bool IsDisposed => disposed;

        /// <summary>For calls of Splat.Interop.Native.</summary>
        public T Handle
        {
            get
            {
                if (disposed) throw new ObjectDisposedException(GetType().FullName);
                return handle;
            }
        }

        /// <summary>Release the object. Never waits for the device.</summary>
        public void Dispose()
        {
            Dispose(true);
            GC.SuppressFinalize(this);
        }

        /// <summary>Release the object; the handle has the finalizer.</summary>
        protected virtual void Dispose(bool disposing)
        {
            disposed = true;
            if (disposing) handle.Dispose();
        }

        /// <summary>What the object is, in a few words; "" for its kind alone.</summary>
        internal virtual string About => "";

        /// <summary>The kind of the object and its size; never throws.</summary>
        public override string ToString()
        {
            string words;
            try
            {
                words = disposed ? "disposed" : About;
            }
            catch (Exception error) when (error is SplatException || error is ObjectDisposedException)
            {
                words = error is SplatException ? error.Message : "disposed";
            }
            return GetType().Name + (words.Length == 0 ? "" : " (" + words + ")");
        }
    }

    /// <summary>
    /// Cancels the calls of a device for as long as one call runs, once a token asks for it. The
    /// library forgets a cancellation that comes just before a call begins, so it is repeated until
    /// the call has ended.
    /// </summary>
    internal sealed class Cancellation : IDisposable
    {
        private readonly object gate = new object();
        private readonly SafeDeviceHandle device;
        private readonly CancellationTokenRegistration registration;
        private bool ended;

        private Cancellation(SafeDeviceHandle device, CancellationToken token)
        {
            bool added = false;
            device.DangerousAddRef(ref added);
            this.device = device;
            try
            {
                registration = token.Register(Start);
            }
            catch  // the source is disposed
            {
                device.DangerousRelease();
                throw;
            }
        }

        /// <summary>
        /// Watch a token; null if it can never be cancelled. Throws OperationCanceledException if
        /// it is cancelled already, and ObjectDisposedException if the device is disposed.
        /// </summary>
        internal static Cancellation? Of(SafeDeviceHandle device, CancellationToken token)
        {
            token.ThrowIfCancellationRequested();
            if (!token.CanBeCanceled) return null;
            if (device.IsClosed)
                throw new ObjectDisposedException(
                    "Splat.Device", "The device is disposed, so its calls cannot be cancelled; " +
                                    "pass no token, or keep the device.");
            return new Cancellation(device, token);
        }

        private void Start()
        {
            new Thread(Repeat) { IsBackground = true, Name = "libsplat cancel" }.Start();
        }

        private void Repeat()
        {
            while (true)
            {
                lock (gate)
                {
                    if (ended) return;
                    Native.splat_device_cancel(device);
                }
                Thread.Sleep(1);
            }
        }

        public void Dispose()
        {
            registration.Dispose();
            lock (gate) ended = true;
            device.DangerousRelease();
        }
    }
}
