using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;
using Splat.Interop;

namespace Splat
{
    /// <summary>A named tensor of a model or a module.</summary>
    public sealed unsafe class Port
    {
        /// <summary>Describe a port, for ModuleOptions.</summary>
        public Port(string name, params long[] dims)
        {
            Name = Check.NotNull(name, nameof(name));
            Dims = Check.NotNull(dims, nameof(dims));
            if (dims.Length > Native.SPLAT_MAX_RANK)
                throw new ArgumentException(name + " has " + dims.Length + " dimensions; the most are " +
                                            Native.SPLAT_MAX_RANK, nameof(dims));
        }

        private Port(splat_port* native)
        {
            Name = Text.Read(native->name, -1);
            Flags = native->flags;
            Dims = Values.Copy(native->dims, (int)native->rank);
        }

        /// <summary>Name of the port.</summary>
        public string Name { get; }
        /// <summary>Optional, trainable, with a gradient.</summary>
        public PortFlags Flags { get; }
        /// <summary>Shape, outermost first.</summary>
        public long[] Dims { get; }

        /// <summary>Number of elements.</summary>
        public long Elements
        {
            get
            {
                long count = 1;
                foreach (long dim in Dims) count *= dim;
                return count;
            }
        }

        internal delegate ResultCode ListCall(splat_port* ports, uint capacity, uint* count);

        /// <summary>
        /// All ports of a list. Their names live as long as the owner, which is kept meanwhile.
        /// </summary>
        internal static Port[] List(SafeHandle owner, ListCall call)
        {
            bool added = false;
            try
            {
                owner.DangerousAddRef(ref added);
                uint count;
                Check.Ok(call(null, 0, &count));
                var natives = new splat_port[count];
                var ports = new Port[count];
                fixed (splat_port* first = natives)
                {
                    Check.Ok(call(first, count, &count));
                    for (int i = 0; i < ports.Length; ++i) ports[i] = new Port(first + i);
                }
                return ports;
            }
            finally
            {
                if (added) owner.DangerousRelease();
            }
        }

        internal static splat_port[] ToNative(IReadOnlyList<Port> ports, Arena arena)
        {
            var natives = new splat_port[ports.Count];
            for (int i = 0; i < natives.Length; ++i)
            {
                Port port = Check.NotNull(ports[i], "ports[" + i + "]");
                natives[i].name = arena.Text(port.Name);
                natives[i].rank = (uint)port.Dims.Length;
                fixed (long* dims = natives[i].dims)
                    for (int k = 0; k < port.Dims.Length; ++k) dims[k] = port.Dims[k];
            }
            return natives;
        }
    }
}
