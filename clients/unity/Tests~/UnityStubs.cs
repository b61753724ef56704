// As much of Unity as PressedRetina touches, so that it is compiled and run without the engine. Conventions are Unity's: left-handed, y up.

using System;
using System.Collections.Generic;

namespace UnityEngine
{
    [AttributeUsage(AttributeTargets.Class)]
    public sealed class RequireComponentAttribute : Attribute
    {
        public RequireComponentAttribute(Type first, Type second) { }
    }

    [AttributeUsage(AttributeTargets.Field)]
    public sealed class TooltipAttribute : Attribute
    {
        public TooltipAttribute(string text) { }
    }

    public struct Vector3
    {
        public float x, y, z;

        public Vector3(float x, float y, float z)
        {
            this.x = x;
            this.y = y;
            this.z = z;
        }
    }

    public struct Quaternion
    {
        public float x, y, z, w;

        public Quaternion(float x, float y, float z, float w)
        {
            this.x = x;
            this.y = y;
            this.z = z;
            this.w = w;
        }

        public static Quaternion identity { get { return new Quaternion(0f, 0f, 0f, 1f); } }

        public static Quaternion Inverse(Quaternion q) { return new Quaternion(-q.x, -q.y, -q.z, q.w); }

        public static Quaternion operator *(Quaternion a, Quaternion b)
        {
            return new Quaternion(
                a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
                a.w * b.y + a.y * b.w + a.z * b.x - a.x * b.z,
                a.w * b.z + a.z * b.w + a.x * b.y - a.y * b.x,
                a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z);
        }
    }

    public struct Color32
    {
        public byte r, g, b, a;

        public Color32(byte r, byte g, byte b, byte a)
        {
            this.r = r;
            this.g = g;
            this.b = b;
            this.a = a;
        }
    }

    public static class Mathf
    {
        public static float Clamp01(float value) { return value < 0f ? 0f : value > 1f ? 1f : value; }
    }

    public static class Debug
    {
        public static readonly List<string> Log = new List<string>();

        public static void LogWarning(object message, object context) { Log.Add(message.ToString()); }
    }

    public sealed class Transform
    {
        public Vector3 position;
        public Quaternion rotation = Quaternion.identity;

        // Of an object that stands at the origin, unturned.
        public Vector3 InverseTransformPoint(Vector3 point)
        {
            return new Vector3(point.x - position.x, point.y - position.y, point.z - position.z);
        }
    }

    public sealed class Mesh
    {
        public string name;
        public Vector3[] vertices = new Vector3[0];
        public Vector3[] normals;
        public Color32[] colors32;
        public int[] triangles;

        public int vertexCount { get { return vertices.Length; } }

        public void MarkDynamic() { }

        public void RecalculateBounds() { }
    }

    public sealed class MeshFilter
    {
        public Mesh mesh;
    }

    public sealed class MeshRenderer { }

    public class MonoBehaviour
    {
        readonly MeshFilter filter = new MeshFilter();

        public Transform transform = new Transform();

        public T GetComponent<T>() where T : class { return filter as T; }
    }
}
