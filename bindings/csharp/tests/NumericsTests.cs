using System;
using System.Linq;
using System.Numerics;

namespace Splat.Tests
{
    internal static class NumericsTests
    {
        private static void Near(Vector3 expected, Vector3 actual) =>
            Expect.True(Vector3.Distance(expected, actual) < 1e-5f, expected + ", got " + actual);

        [Test]
        private static void CamerasConvert()
        {
            Camera camera = Camera.FromFov(40, 30, 0.7)
                .LookAt(new Vector3(1, 2, -3), new Vector3(0, 0.5f, 0), -Vector3.UnitY);
            Camera same = Camera.FromFov(40, 30, 0.7)
                .LookAt(new double[] { 1, 2, -3 }, new[] { 0, 0.5, 0 }, new double[] { 0, -1, 0 });
            Expect.Equal(same, camera);
            Near(new Vector3(1, 2, -3), camera.Position());
            Matrix4x4 pose = camera.ToMatrix();
            Near(Vector3.Zero, Vector3.Transform(camera.Position(), pose));
            Vector3 seen = Vector3.Transform(new Vector3(0, 0.5f, 0), pose);  // what it looks at is straight ahead
            Near(new Vector3(0, 0, Vector3.Distance(camera.Position(), new Vector3(0, 0.5f, 0))), seen);
            Camera back = camera.WithPose(pose);
            for (int i = 0; i < 16; ++i) Expect.Near(camera.WorldToCamera[i], back.WorldToCamera[i], 1e-6);
            Expect.Contains("transposed", Expect.Throws<ArgumentException>(
                () => camera.WithPose(Matrix4x4.Transpose(pose))).Message);
        }

        [Test]
        private static void SimilaritiesConvert()
        {
            Quaternion turn = Quaternion.CreateFromYawPitchRoll(0.3f, -0.4f, 2);
            var similarity = new Similarity
                { Rotation = turn.ToNumbers(), Translation = new Vector3(1, 2, 3).ToNumbers(), Scale = 2 };
            Matrix4x4 matrix = similarity.ToMatrix();
            Vector3[] before;
            using (Scene scene = Shared.ThreeGaussians())
            {
                before = scene.ReadVectors("means");
                scene.Transform(similarity);
                Vector3[] after = scene.ReadVectors("means");
                for (int i = 0; i < 3; ++i) Near(Vector3.Transform(before[i], matrix), after[i]);
            }
            Similarity back = matrix.ToSimilarity();
            Expect.Near(2, back.Scale, 1e-5);
            Near(new Vector3(1, 2, 3), Vector3.Transform(Vector3.Zero, back.ToMatrix()));
            Near(Vector3.Transform(before[1], matrix), Vector3.Transform(before[1], back.ToMatrix()));
            foreach (Matrix4x4 bad in new[]
            {
                Matrix4x4.CreateScale(1, 2, 1), new Matrix4x4(), Matrix4x4.CreateScale(-1, 1, 1),
                Matrix4x4.CreatePerspective(1, 1, 1, 2), Matrix4x4.CreateScale(float.NaN),
            })
                Expect.Contains("alike in all directions",
                                Expect.Throws<ArgumentException>(() => bad.ToSimilarity()).Message);
        }

        [Test]
        private static void ScenesGiveAndTakeVectors()
        {
            using (Scene scene = Shared.ThreeGaussians())
            {
                Expect.Equal(new Vector3(0, 0, 0.5f), scene.ReadVectors("means")[1]);
                Expect.Same(Enumerable.Repeat(Quaternion.Identity, 3), scene.ReadQuaternions());
                Quaternion one = Quaternion.Identity;
                var turned = new[] { new Quaternion(0.5f, -0.5f, 0.5f, 0.5f), one, one };
                scene.WriteQuaternions(turned);
                Expect.Same(turned, scene.ReadQuaternions());
                Expect.Same(new[] { 0.5f, 0.5f, -0.5f, 0.5f }, scene.Read("rotations").Take(4));
                scene.WriteVectors("means", new[] { Vector3.UnitX, Vector3.UnitY, Vector3.UnitZ });
                Expect.Same(new float[] { 1, 0, 0, 0, 1, 0, 0, 0, 1 }, scene.Read("means"));
                Expect.Refused(ResultCode.ErrorInvalidArgument, "", () => scene.ReadVectors("rotations"));
                Expect.Refused(ResultCode.ErrorInvalidArgument, "", () => scene.WriteVectors("means", new Vector3[2]));
                Expect.Throws<ArgumentNullException>(() => ((Scene)null).ReadQuaternions());
            }
        }
    }
}
