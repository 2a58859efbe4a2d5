using System;
using System.Collections.Concurrent;
using System.IO;
using System.Linq;
using System.Runtime.InteropServices;
using System.Threading;

namespace Splat.Tests
{
    /// <summary>Trainings of several ranks, which are threads here.</summary>
    internal static class RanksTests
    {
        private const int Limit = 120000;  // ms that a rank waits for another

        /// <summary>Where the ranks meet: what each has sent to each.</summary>
        private sealed class Meeting
        {
            internal readonly BlockingCollection<byte[]>[,] Sent;
            internal readonly CancellationTokenSource Over = new CancellationTokenSource();

            internal Meeting(int count)
            {
                Sent = new BlockingCollection<byte[]>[count, count];
                for (int i = 0; i < count * count; ++i) Sent[i / count, i % count] = new BlockingCollection<byte[]>();
            }
        }

        private class Threads : Ranks
        {
            private readonly Meeting meeting;

            internal Threads(int rank, int count, Meeting meeting) : base(rank, count)
            {
                this.meeting = meeting;
            }

            public override void SendReceive(int peer, ReadOnlySpan<byte> sent, Span<byte> received)
            {
                meeting.Sent[Rank, peer].Add(sent.ToArray());
                Take(peer).CopyTo(received);
            }

            public override void Broadcast(int root, Span<byte> data)
            {
                if (Rank != root) Take(root).CopyTo(data);
                else
                    for (int other = 0; other < Count; ++other)
                        if (other != root) meeting.Sent[root, other].Add(data.ToArray());
            }

            public override void Barrier()
            {
                for (int other = 0; other < Count; ++other)
                    if (other != Rank) SendReceive(other, new byte[1], new byte[1]);
            }

            private Span<byte> Take(int peer)
            {
                byte[] taken;
                if (!meeting.Sent[peer, Rank].TryTake(out taken, Limit, meeting.Over.Token))
                    throw new TimeoutException("rank " + peer + " sends nothing");
                return taken;
            }
        }

        /// <summary>Gradients are summed by this class.</summary>
        private sealed class Summing : Threads
        {
            internal Summing(int rank, int count, Meeting meeting) : base(rank, count, meeting)
            {
            }

            public override bool Sums => true;

            public override void Sum(Span<float> values)
            {
                var share = new float[values.Length];
                SendReceive(1 - Rank, MemoryMarshal.AsBytes(values), MemoryMarshal.AsBytes(share.AsSpan()));
                for (int i = 0; i < share.Length; ++i) values[i] += share[i];
            }
        }

        /// <summary>Rank 1 throws where gradients are exchanged.</summary>
        private sealed class Fails : Threads
        {
            internal Fails(int rank, int count, Meeting meeting) : base(rank, count, meeting)
            {
            }

            public override void SendReceive(int peer, ReadOnlySpan<byte> sent, Span<byte> received)
            {
                if (sent.Length > 1000 && Rank == 1) throw new InvalidOperationException("unplugged");
                base.SendReceive(peer, sent, received);
            }
        }

        private static TrainingOptions Options(Ranks ranks = null) => new TrainingOptions
        {
            Config = ModelTests.Tiny,
            Values = new[]
            {
                "data.root='" + Cars.Folder + "'", "opt.iterations=3", "opt.batch_size=4", "opt.micro_batch=1",
                "logging.val_log=0",
            },
            Ranks = ranks,
        };

        /// <summary>What each rank threw.</summary>
        private static Exception[] Train(string folder, int count, Func<int, Meeting, Ranks> made)
        {
            var meeting = new Meeting(count);
            var thrown = new Exception[count];
            Thread[] threads = Enumerable.Range(0, count).Select(rank => new Thread(() =>
            {
                try
                {
                    using (var device = new Device())
                    using (var training = new Training(device, folder, Options(made(rank, meeting))))
                        Expect.Equal(RunEventKind.Done, training.Last().Kind);
                }
                catch (Exception error)
                {
                    thrown[rank] = error;
                    meeting.Over.Cancel();
                }
            })).ToArray();
            foreach (Thread thread in threads) thread.Start();
            foreach (Thread thread in threads) thread.Join();
            return thrown;
        }

        [Test]
        private static void TwoThreadsHaveTheBitsOfOne()
        {
            string one = Shared.PathOf("ranks-one"), two = Shared.PathOf("ranks-two");
            using (var training = new Training(Shared.Device, one, Options()))
                Expect.Equal(RunEventKind.Done, training.Last().Kind);
            foreach (Exception error in Train(two, 2, (rank, meeting) => new Threads(rank, 2, meeting)))
                if (error != null) throw error;
            Expect.Same(File.ReadAllBytes(Path.Combine(one, "weights_last.safetensors")),
                        File.ReadAllBytes(Path.Combine(two, "weights_last.safetensors")));
        }

        [Test]
        private static void ASumWithoutOrderIsUsed()
        {
            string folder = Shared.PathOf("ranks-sum");
            foreach (Exception error in Train(folder, 2, (rank, meeting) => new Summing(rank, 2, meeting)))
                if (error != null) throw error;
            Expect.Contains("\"reproducible\": false", File.ReadAllText(Path.Combine(folder, "run.json")));
        }

        [Test]
        private static void ExceptionsCross()
        {
            Exception[] thrown = Train(Shared.PathOf("ranks-fail"), 2, (rank, meeting) => new Fails(rank, 2, meeting));
            Expect.True(thrown[1] is InvalidOperationException && thrown[1].Message == "unplugged", "that of rank 1");
            Expect.True(thrown[0] is OperationCanceledException, "rank 0 does not wait: " + thrown[0]);
        }

        [Test]
        private static void BadRanksAreRefused()
        {
            string folder = Shared.PathOf("ranks-bad");
            foreach (int count in new[] { 3, 0 })
                Expect.Refused(ResultCode.ErrorInvalidArgument, " ranks, expected 1, 2, 4", () =>
                    new Training(Shared.Device, folder, Options(new Threads(0, count, new Meeting(3)))));
            Expect.Refused(ResultCode.ErrorInvalidArgument, "rank 2 of 2", () =>
                new Training(Shared.Device, folder, Options(new Threads(2, 2, new Meeting(3)))));
            Expect.True(!Directory.Exists(folder), "no folder is made");
        }
    }
}
