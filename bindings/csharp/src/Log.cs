using System;
using System.Threading;
using Splat.Interop;

namespace Splat
{
    /// <summary>The log of the library, for the whole process. Without a handler it is silent.</summary>
    public static unsafe class Log
    {
        // The library holds its pointer, so it is never collected.
        private static readonly splat_log_callback Callback = Receive;
        private static volatile Action<LogLevel, string>? handler;
        private static int watchesExit;

        /// <summary>
        /// An exception of the handler, on the thread of the message. It never reaches the library
        /// or the call that logged; without a subscriber it is kept in LastFailure only.
        /// </summary>
        public static event Action<Exception>? HandlerFailed;

        /// <summary>The latest exception of a handler, or null.</summary>
        public static Exception? LastFailure { get; private set; }

        /// <summary>
        /// Send messages of a level and above to `next`; null: silence. It is called at the end of
        /// the call that caused the message, on that call's thread (the collector's for objects
        /// that were not disposed), and may call the library. When this function returns, no other
        /// thread runs the handler before.
        /// Throws SplatException for a level that does not exist; the handler before then stays.
        /// </summary>
        public static void SetHandler(Action<LogLevel, string>? next,
                                      LogLevel minimum = LogLevel.Warning)
        {
            Library.Ensure();
            if (Interlocked.Exchange(ref watchesExit, 1) == 0)
            {
                AppDomain.CurrentDomain.ProcessExit += (sender, arguments) => Silence();
                AppDomain.CurrentDomain.DomainUnload += (sender, arguments) => Silence();
            }
            Action<LogLevel, string>? before = handler;
            handler = next;
            ResultCode code = Native.splat_log_set_callback(next == null ? null : Callback, null, minimum);
            if (code < 0) handler = before;
            Check.Ok(code);
        }

        /// <summary>No managed code may be called once the runtime goes down.</summary>
        private static void Silence()
        {
            handler = null;
            Native.splat_log_set_callback(null, null, LogLevel.Warning);
        }

        private static void Receive(void* user, LogLevel level, byte* message)
        {
            try
            {
                handler?.Invoke(level, Text.Read(message, -1));
            }
            catch (Exception error)
            {
                LastFailure = error;
                try
                {
                    HandlerFailed?.Invoke(error);
                }
                catch (Exception second)
                {
                    LastFailure = second;
                }
            }
        }
    }
}
