using System;
using System.Threading;
using System.Threading.Tasks;
using Splat.Interop;

namespace Splat
{
    /// <summary>A data set that meshes are drawn into, and one of its objects.</summary>
    public sealed class MeshViewsOptions
    {
        /// <summary>Folder of the data set.</summary>
        public string? Path { get; set; }
        /// <summary>Name of the object.</summary>
        public string? Name { get; set; }
        /// <summary>"srn", "images"; null: srn.</summary>
        public string? Layout { get; set; }
        /// <summary>In names of folders; null: objects.</summary>
        public string? Category { get; set; }
        /// <summary>"train", "val", "test"; null: train.</summary>
        public string? Split { get; set; }
        /// <summary>How meshes were made ready, in words that all objects of a folder have in common.</summary>
        public string? Prepared { get; set; }
        /// <summary>Maps besides pictures, and where is up.</summary>
        public MeshViewsFlags Flags { get; set; } =
            MeshViewsFlags.Depth | MeshViewsFlags.Normal | MeshViewsFlags.Mask;
        /// <summary>With the name it decides all that is random.</summary>
        public long Seed { get; set; }
        /// <summary>Side of the images, 8 to 2048.</summary>
        public int Size { get; set; } = 128;
        /// <summary>Views of an object of train.</summary>
        public int TrainViews { get; set; } = 50;
        /// <summary>Views of an object of val and test.</summary>
        public int TestViews { get; set; } = 251;
        /// <summary>Of a pixel's side: 1, 2, 4 or 8.</summary>
        public int Samples { get; set; } = 4;
        /// <summary>Points on the surface; 0: none.</summary>
        public int Points { get; set; } = 10000;
        /// <summary>Where cameras stand.</summary>
        public MeshProtocol Protocol { get; set; }
        /// <summary>What is behind the object.</summary>
        public MeshBackground Background { get; set; }
        /// <summary>Distance of the cameras from the origin.</summary>
        public double Distance { get; set; } = 1.3;
        /// <summary>Field of view, radians; 0: SRN's.</summary>
        public double FovX { get; set; }
        /// <summary>Height of an orbit above the horizon, radians.</summary>
        public double Elevation { get; set; }
        /// <summary>Radians: cameras roll, and aim beside the origin, by up to this angle.</summary>
        public double Jitter { get; set; }
        /// <summary>Stops: objects are darker or brighter by up to this.</summary>
        public double Exposure { get; set; }

        internal unsafe splat_mesh_views_desc ToNative(Arena arena) => new splat_mesh_views_desc
        {
            struct_size = (uint)sizeof(splat_mesh_views_desc),
            flags = Flags,
            path = arena.Optional(Path, nameof(Path)),
            layout = arena.Optional(Layout, nameof(Layout)),
            category = arena.Optional(Category, nameof(Category)),
            split = arena.Optional(Split, nameof(Split)),
            name = arena.Optional(Name, nameof(Name)),
            prepared = arena.Optional(Prepared, nameof(Prepared)),
            seed = unchecked((ulong)Seed),
            size = Check.Unsigned(Size, nameof(Size)),
            train_views = Check.Unsigned(TrainViews, nameof(TrainViews)),
            test_views = Check.Unsigned(TestViews, nameof(TestViews)),
            samples = Check.Unsigned(Samples, nameof(Samples)),
            points = Check.Unsigned(Points, nameof(Points)),
            protocol = Protocol,
            background = Background,
            distance = Distance,
            fov_x = FovX,
            elevation = Elevation,
            jitter = Jitter,
            exposure = Exposure,
        };
    }

    public sealed unsafe partial class Mesh
    {
        /// <summary>True if the object is there already, so that its mesh need not be read.</summary>
        public static bool FindViews(MeshViewsOptions options)
        {
            using (var arena = new Arena())
            {
                splat_mesh_views_desc desc = Check.NotNull(options, nameof(options)).ToNative(arena);
                int found;
                Check.Ok(Native.splat_mesh_find_views(&desc, &found));
                return found != 0;
            }
        }

        /// <summary>
        /// Draw the mesh as an object of a data set. Its folder appears whole or not at all; one that is there
        /// is kept.
        /// </summary>
        /// <param name="device">draws</param>
        /// <param name="options">which object of which data set</param>
        /// <param name="token">cancels all calls of the device</param>
        public void WriteViews(Device device, MeshViewsOptions options,
                               CancellationToken token = default(CancellationToken))
        {
            Check.NotNull(device, nameof(device));
            using (var arena = new Arena())
            using (Cancellation.Of(device.Handle, token))
            {
                splat_mesh_views_desc desc = Check.NotNull(options, nameof(options)).ToNative(arena);
                Check.Ok(Native.splat_mesh_write_views(Handle, device.Handle, &desc), token);
            }
        }

        /// <summary>Draw on another thread, see WriteViews.</summary>
        public Task WriteViewsAsync(Device device, MeshViewsOptions options,
                                    CancellationToken token = default(CancellationToken)) =>
            Task.Run(() => WriteViews(device, options, token), token);
    }
}
