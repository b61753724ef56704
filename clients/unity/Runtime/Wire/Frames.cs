using System;

namespace Retina
{
    /// <summary>Three numbers.</summary>
    public struct Triple
    {
        public float X, Y, Z;

        public Triple(float x, float y, float z)
        {
            X = x;
            Y = y;
            Z = z;
        }
    }

    /// <summary>A rotation, x, y, z, w.</summary>
    public struct Rotation
    {
        public float X, Y, Z, W;

        public Rotation(float x, float y, float z, float w)
        {
            X = x;
            Y = y;
            Z = z;
            W = w;
        }
    }

    /// <summary>
    /// From the service's frame to Unity's and back. The service's is right-handed, in mm, +z out of the tissue; Unity's is left-handed with +y up.
    /// Exchanging y and z does both: it is a mirror image, its own inverse, and turns +z into up. A mirror image turns rotations the other way
    /// round, so the vector part of a quaternion changes its sign beside the exchange, and triangles change their order so that their
    /// front, counter-clockwise there and clockwise here, stays on the side of the vitreous. A needle points along -z there and along -y (its -up) here.
    /// </summary>
    public static class Frames
    {
        /// <summary>A direction or force of either frame in the other.</summary>
        public static Triple Exchange(Triple vector)
        {
            return new Triple(vector.X, vector.Z, vector.Y);
        }

        /// <summary>A point of the service (mm) in units of Unity.</summary>
        public static Triple ToUnity(Triple pointMm, float unitsPerMm)
        {
            return new Triple(unitsPerMm * pointMm.X, unitsPerMm * pointMm.Z, unitsPerMm * pointMm.Y);
        }

        /// <summary>A point of Unity in mm of the service.</summary>
        public static Triple FromUnity(Triple point, float unitsPerMm)
        {
            return new Triple(point.X / unitsPerMm, point.Z / unitsPerMm, point.Y / unitsPerMm);
        }

        /// <summary>A rotation of either frame in the other.</summary>
        public static Rotation Exchange(Rotation rotation)
        {
            return new Rotation(-rotation.X, -rotation.Z, -rotation.Y, rotation.W);
        }

        /// <summary>Corners of triangles of either frame in the other, three for each.</summary>
        public static int[] Exchange(int[] corners)
        {
            var exchanged = new int[corners.Length];
            for (var at = 0; at < corners.Length; at += 3)
            {
                exchanged[at] = corners[at];
                exchanged[at + 1] = corners[at + 2];
                exchanged[at + 2] = corners[at + 1];
            }
            return exchanged;
        }
    }
}
