using System;
using System.IO;
using System.Linq;

namespace Splat.Tests
{
    internal static class PriorTests
    {
        private static Image Map(int channels, params float[] samples)
        {
            return Image.FromFloats(samples.Length / channels, 1, channels, samples);
        }

        [Test]
        private static void DepthIsAligned()
        {
            Image truth = Map(1, 1, 2, 3, 0);
            DepthScores scores = Priors.CompareDepth(Map(1, 2, 4, 6, 9), truth);
            Expect.Equal(3L, scores.Pixels);
            Expect.Near(0.5, scores.Scale, 1e-12);
            Expect.Near(0, scores.Rmse, 1e-12);
            Expect.Equal(4L, Priors.CompareDepth(truth, truth, null, DepthFlags.AsPublished).Pixels);
            Expect.Equal(2L, Priors.CompareDepth(truth, truth, Map(1, 1, 1, 0, 0)).Pixels);
            Expect.Refused(ResultCode.ErrorShapeMismatch, "truth",
                           () => Priors.CompareDepth(truth, Map(1, 1)));
            Expect.Throws<ArgumentNullException>(() => Priors.CompareDepth(null, truth));
        }

        [Test]
        private static void NormalsMasksAndImagesAreCompared()
        {
            Image x = Map(3, 1, 0, 0), z = Map(3, 0, 0, 1);
            Expect.Near(90, Priors.CompareNormals(x, z, null, NormalFlags.Vectors).Median, 1e-9);
            Image planes = Priors.PlanesFromDepth(Image.FromFloats(8, 8, 1, Enumerable.Repeat(2f, 64).ToArray()), 8);
            Expect.Near(2, planes.ToFloats()[3], 1e-6);
            Expect.Near(1, Priors.ComparePlanes(planes, planes).Recall, 0);
            MaskScores scores = Priors.CompareMasks(Map(1, 1, 0, 0), Map(1, 1, 0.25f, 0),
                                                    MaskFlags.AlphaHalf);
            Expect.Equal(1L, scores.TruePixels);
            Expect.Near(1, scores.Iou, 1e-5);
            float[] samples = Enumerable.Range(0, 41 * 41).Select(i => i * 37 % 64 / 64f).ToArray();
            Image image = Image.FromFloats(41, 41, 1, samples);
            Expect.Near(1, Priors.CompareFidelity(image, image).Vif, 1e-6);
            Expect.Equal(41 * 41, Priors.FilterMap(image, MapFilter.Opening).ToFloats().Length);
        }

        [Test]
        private static void PointsComeFromMeshesAndDepth()
        {
            string path = Shared.PathOf("square.obj");
            File.WriteAllText(path, "v 0 0 2\nv 1 0 2\nv 1 1 2\nv 0 1 2\nf 1 2 3 4\n");
            float[] points = Priors.MeshPoints(path, 50, 7);
            Expect.Equal(150, points.Length);
            Expect.Equal(2f, points[2]);
            using (var scene = new Scene(50, 0, new SceneArrays { Means = points }))
                Expect.Equal(1.0, scene.ComparePoints(points, 1e-6).FScore);
            Camera camera = Camera.FromFov(2, 1, 1);
            Expect.Equal(3, Priors.DepthPoints(Map(1, 0, 2), camera).Length);
        }
    }
}
