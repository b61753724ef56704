using System;

namespace Retina
{
    /// <summary>Where the needle is and how it pushes; service's frame, mm and mN.</summary>
    public struct Pose
    {
        public Triple TipMm;
        public Rotation Orientation;
        /// <summary>Whether the needle advances along a force; otherwise it stays where it is and the reaction is the answer.</summary>
        public bool HasForce;
        public Triple ForceMn;
    }

    /// <summary>
    /// The binary messages of a stream, as server/src/stream/binary.rs documents them: little-endian, 32-bit numbers; units mm, mN, µm.
    /// </summary>
    public sealed class Surface
    {
        const int HeaderBytes = 24;
        const int PoseBytes = 64;
        const int AnswerBytes = 116;
        const int BytesPerNode = 28;
        const byte Version = 1;
        const byte PoseKind = 1;
        const byte AnswerKind = 2;
        const int CutFlag = 4;

        /// <summary>Number of the pose that this answers.</summary>
        public ulong Sequence;
        /// <summary>Poses since the last answer that a newer one overtook.</summary>
        public uint Dropped;
        /// <summary>0 linear, 1 coarse, 2 reference, 3 network, 4 corrected.</summary>
        public byte Level;
        /// <summary>0 clear, 1 touching, 2 slipping, 3 punctured.</summary>
        public byte Contact;
        public Triple TipMm;
        public float TravelMm;
        /// <summary>Force of the tissue on the needle.</summary>
        public Triple ReactionMn;
        /// <summary>Error of the worst node, 95 %; NaN where unknown.</summary>
        public float ExpectedErrorUm;
        public Triple[] VerticesMm;
        public Triple[] Normals;
        public float[] DisplacementUm;
        /// <summary>Corners of the triangles of a patch that is cut from a mesh; null where they are the session's.</summary>
        public int[] Corners;

        /// <summary>The message of a pose.</summary>
        public static byte[] Write(ulong sequence, Pose pose)
        {
            var bytes = new byte[PoseBytes];
            bytes[0] = (byte)'R';
            bytes[1] = (byte)'T';
            bytes[2] = (byte)'N';
            bytes[3] = (byte)'A';
            bytes[4] = Version;
            bytes[5] = PoseKind;
            bytes[6] = (byte)(pose.HasForce ? 1 : 0);
            for (var at = 0; at < 8; at++)
            {
                bytes[8 + at] = (byte)(sequence >> (8 * at));
            }
            var force = pose.HasForce ? pose.ForceMn : new Triple();
            var turned = pose.Orientation;
            var numbers = new[]
            {
                pose.TipMm.X, pose.TipMm.Y, pose.TipMm.Z, turned.X, turned.Y, turned.Z, turned.W, force.X, force.Y, force.Z,
            };
            for (var index = 0; index < numbers.Length; index++)
            {
                var number = BitConverter.GetBytes(numbers[index]);
                if (!BitConverter.IsLittleEndian)
                {
                    Array.Reverse(number);
                }
                number.CopyTo(bytes, HeaderBytes + 4 * index);
            }
            return bytes;
        }

        /// <summary>The answer in a message.</summary>
        /// <exception cref="FormatException">The message is not an answer of this layout.</exception>
        public static Surface Read(byte[] bytes)
        {
            var isAnswer = bytes.Length >= AnswerBytes && bytes[0] == 'R' && bytes[1] == 'T' && bytes[2] == 'N' && bytes[3] == 'A'
                && bytes[4] == Version && bytes[5] == AnswerKind;
            var count = isAnswer ? bytes[30] | bytes[31] << 8 : 0;
            var end = AnswerBytes + BytesPerNode * count;
            if (!isAnswer || bytes.Length < end)
            {
                throw new FormatException("not an answer of layout " + Version);
            }
            var surface = new Surface
            {
                Sequence = Whole(bytes, 8) | (ulong)Whole(bytes, 12) << 32,
                Dropped = Whole(bytes, 24),
                Level = bytes[28],
                Contact = bytes[29],
                TipMm = Three(bytes, 48),
                TravelMm = Number(bytes, 60),
                ReactionMn = Three(bytes, 64),
                ExpectedErrorUm = Number(bytes, 96),
                VerticesMm = new Triple[count],
                Normals = new Triple[count],
                DisplacementUm = new float[count],
            };
            for (var node = 0; node < count; node++)
            {
                surface.VerticesMm[node] = Three(bytes, AnswerBytes + 12 * node);
                surface.Normals[node] = Three(bytes, AnswerBytes + 12 * (count + node));
                surface.DisplacementUm[node] = Number(bytes, AnswerBytes + 24 * count + 4 * node);
            }
            if ((bytes[6] & CutFlag) != 0)
            {
                surface.Corners = new int[3 * Whole(bytes, end)];
                for (var corner = 0; corner < surface.Corners.Length; corner++)
                {
                    surface.Corners[corner] = (int)Whole(bytes, end + 4 + 4 * corner);
                }
            }
            return surface;
        }

        static uint Whole(byte[] bytes, int at)
        {
            return bytes[at] | (uint)bytes[at + 1] << 8 | (uint)bytes[at + 2] << 16 | (uint)bytes[at + 3] << 24;
        }

        static float Number(byte[] bytes, int at)
        {
            if (BitConverter.IsLittleEndian)
            {
                return BitConverter.ToSingle(bytes, at);
            }
            return BitConverter.ToSingle(new[] { bytes[at + 3], bytes[at + 2], bytes[at + 1], bytes[at] }, 0);
        }

        static Triple Three(byte[] bytes, int at)
        {
            return new Triple(Number(bytes, at), Number(bytes, at + 4), Number(bytes, at + 8));
        }
    }
}
