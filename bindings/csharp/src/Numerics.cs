using System;
using System.Collections.Generic;
using System.Numerics;
using System.Runtime.InteropServices;

namespace Splat
{
    /// <summary>
    /// Conversions from and to System.Numerics. Its matrices act on rows, Vector3.Transform(point, matrix), so they are
    /// the transposed ones of poses here, and its quaternions are x, y, z, w instead of w, x, y, z. They have the
    /// precision of float.
    /// </summary>
    public static class NumericsExtensions
    {
        /// <summary>The pose of a camera: from the world to the camera's axes x right, y down, z forward.</summary>
        public static Matrix4x4 ToMatrix(this Camera camera)
        {
            IReadOnlyList<double> m = Check.NotNull(camera, nameof(camera)).WorldToCamera;
            return new Matrix4x4((float)m[0], (float)m[4], (float)m[8], (float)m[12],
                                 (float)m[1], (float)m[5], (float)m[9], (float)m[13],
                                 (float)m[2], (float)m[6], (float)m[10], (float)m[14],
                                 (float)m[3], (float)m[7], (float)m[11], (float)m[15]);
        }

        /// <summary>The camera with such a pose.</summary>
        public static Camera WithPose(this Camera camera, Matrix4x4 pose) =>
            Check.NotNull(camera, nameof(camera)).With(worldToCamera: new double[]
            {
                pose.M11, pose.M21, pose.M31, pose.M41, pose.M12, pose.M22, pose.M32, pose.M42,
                pose.M13, pose.M23, pose.M33, pose.M43, pose.M14, pose.M24, pose.M34, pose.M44,
            });

        /// <summary>Where the camera is in the world.</summary>
        public static Vector3 Position(this Camera camera)
        {
            Matrix4x4.Invert(camera.ToMatrix(), out Matrix4x4 inverse);
            return inverse.Translation;
        }

        /// <summary>The camera at `eye`, looking at `target`, with `up` upwards in the image.</summary>
        public static Camera LookAt(this Camera camera, Vector3 eye, Vector3 target, Vector3 up) =>
            Check.NotNull(camera, nameof(camera)).LookAt(eye.ToNumbers(), target.ToNumbers(), up.ToNumbers());

        /// <summary>x, y, z.</summary>
        public static double[] ToNumbers(this Vector3 vector) => new double[] { vector.X, vector.Y, vector.Z };

        /// <summary>w, x, y, z.</summary>
        public static double[] ToNumbers(this Quaternion rotation) =>
            new double[] { rotation.W, rotation.X, rotation.Y, rotation.Z };

        /// <summary>A similarity as a matrix.</summary>
        public static Matrix4x4 ToMatrix(this Similarity similarity)
        {
            Check.NotNull(similarity, nameof(similarity));
            double[] r = similarity.Rotation;
            double[] t = similarity.Translation;
            Check.Numbers<double>(r, 4, nameof(similarity.Rotation));
            Check.Numbers<double>(t, 3, nameof(similarity.Translation));
            var turn = new Quaternion((float)r[1], (float)r[2], (float)r[3], (float)r[0]);
            Matrix4x4 matrix = Matrix4x4.CreateFromQuaternion(Quaternion.Normalize(turn)) *
                               Matrix4x4.CreateScale((float)similarity.Scale);
            matrix.Translation = new Vector3((float)t[0], (float)t[1], (float)t[2]);
            return matrix;
        }

        /// <summary>
        /// A matrix that turns, moves and scales alike in all directions; others throw ArgumentException.
        /// </summary>
        public static Similarity ToSimilarity(this Matrix4x4 matrix)
        {
            // A thousandth is more than products of float matrices lose.
            if (!Matrix4x4.Decompose(matrix, out Vector3 scale, out Quaternion turn, out Vector3 move) ||
                !(scale.X > 0) || Vector3.Distance(scale, new Vector3(scale.X)) > 1e-3f * scale.X ||
                new Vector4(matrix.M14, matrix.M24, matrix.M34, matrix.M44) != Vector4.UnitW)
                throw new ArgumentException(
                    "the matrix does more than to turn, to move and to scale alike in all directions", nameof(matrix));
            return new Similarity { Rotation = turn.ToNumbers(), Translation = move.ToNumbers(), Scale = scale.X };
        }

        /// <summary>"means", "scales" or "log_scales" of a scene in a new array.</summary>
        public static Vector3[] ReadVectors(this Scene scene, string name)
        {
            Vector3[] vectors = Values.New<Vector3>("the vectors", Check.NotNull(scene, nameof(scene)).Count);
            scene.Read(name, MemoryMarshal.Cast<Vector3, float>(vectors));
            return vectors;
        }

        /// <summary>Replace them.</summary>
        public static void WriteVectors(this Scene scene, string name, ReadOnlySpan<Vector3> vectors) =>
            Check.NotNull(scene, nameof(scene)).Write(name, MemoryMarshal.Cast<Vector3, float>(vectors));

        /// <summary>The rotations of a scene in a new array.</summary>
        public static Quaternion[] ReadQuaternions(this Scene scene)
        {
            Quaternion[] all = Values.New<Quaternion>("the rotations", Check.NotNull(scene, nameof(scene)).Count);
            scene.Read("rotations", MemoryMarshal.Cast<Quaternion, float>(all));
            for (int i = 0; i < all.Length; ++i) all[i] = new Quaternion(all[i].Y, all[i].Z, all[i].W, all[i].X);
            return all;
        }

        /// <summary>Replace them.</summary>
        public static void WriteQuaternions(this Scene scene, ReadOnlySpan<Quaternion> rotations)
        {
            Quaternion[] all = rotations.ToArray();
            for (int i = 0; i < all.Length; ++i) all[i] = new Quaternion(all[i].W, all[i].X, all[i].Y, all[i].Z);
            Check.NotNull(scene, nameof(scene)).Write("rotations", MemoryMarshal.Cast<Quaternion, float>(all));
        }
    }
}
