using System;
using System.IO;
using System.Linq;

namespace Splat.Tests
{
    internal static class MeshTests
    {
        private static Mesh Square()
        {
            return new Mesh(new MeshArrays
            {
                Vertices = new double[] { -1, -1, 3, 1, -1, 3, 1, 1, 3, -1, 1, 3 },
                Triangles = new uint[] { 0, 2, 1, 0, 3, 2 },
            });
        }

        [Test]
        private static void MeshesAreMeasuredAndSampled()
        {
            string path = Shared.PathOf("triangle.obj");
            File.WriteAllText(path, "v 0 0 0\nv 4 0 0\nv 4 2 0\nf 1 2 3\n");
            using (Mesh mesh = Mesh.Load(path))
            {
                Expect.Equal(4.0, mesh.Info.Area);
                mesh.Normalise(MeshSize.UnitCube);
                Expect.Equal(0.25, mesh.Info.High[1]);
                Expect.Same(mesh.Sample(10, 1), mesh.Sample(20, 1).Take(30));
                Expect.True(mesh.LoadReportJson().Contains("warnings"), "a report");
            }
            Expect.Refused(ResultCode.ErrorNotFound, "no.obj", () => Mesh.Load(Shared.PathOf("no.obj")));
        }

        [Test]
        private static void MeshesAreDrawn()
        {
            using (Mesh mesh = Square())
            {
                Camera camera = Camera.FromFov(16, 12, 1.1);
                var maps = new MeshMaps
                {
                    Color = new Image(16, 12, 4, Pixel.U8),
                    Depth = new Image(16, 12, 1, Pixel.F32),
                };
                mesh.Render(Shared.Device, new[] { camera }, new[] { maps });
                Expect.Near(3, maps.Depth.ToFloats()[6 * 16 + 8], 1e-5);
                Expect.Equal((byte)255, maps.Color.Data[4 * (6 * 16 + 8) + 3]);
                Expect.Equal((byte)0, maps.Color.Data[3]);
                Expect.Refused(ResultCode.ErrorInvalidArgument, "at least one map",
                               () => mesh.Render(Shared.Device, new[] { camera }, new[] { new MeshMaps() }));
                Expect.Throws<ArgumentException>(
                    () => mesh.Render(Shared.Device, new[] { camera }, new MeshMaps[0]));
            }
        }

        [Test]
        private static void MeshesBecomeADataSet()
        {
            using (Mesh mesh = Square())
            {
                mesh.Normalise(MeshSize.UnitDiagonal);
                var options = new MeshViewsOptions
                {
                    Path = Shared.PathOf("mesh_views"),
                    Name = "square",
                    Size = 16,
                    TrainViews = 2,
                    Protocol = MeshProtocol.Orbit,
                    Flags = MeshViewsFlags.Mask | MeshViewsFlags.YUp,
                };
                Expect.True(!Mesh.FindViews(options), "nothing is there");
                mesh.WriteViews(Shared.Device, options);
                Expect.True(Mesh.FindViews(options), "it is there");
                options.Size = 8;
                Expect.Refused(ResultCode.ErrorInvalidArgument, "made with other values",
                               () => mesh.WriteViews(Shared.Device, options));
            }
        }
    }
}
