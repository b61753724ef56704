// Tests without the engine: `mono press.exe ws://host:port/v1/stream`. Frames and messages, then PressedRetina against a running service.

using System;
using System.Collections.Generic;
using System.Globalization;
using System.Reflection;
using System.Threading;
using Retina;
using UnityEngine;

static class Press
{
    const double PatienceS = 20.0;

    static int Main(string[] arguments)
    {
        CultureInfo.DefaultThreadCurrentCulture = CultureInfo.InvariantCulture;
        Thread.CurrentThread.CurrentCulture = CultureInfo.InvariantCulture;
        RotationsTurnTheSameVectors();
        TrianglesKeepTheirFront();
        MessagesAreAsTheServerReadsThem();
        TextsAreRead();
        Console.WriteLine("frames and messages: in order");
        if (arguments.Length > 0)
        {
            AMeshIsPressed(arguments[0]);
            ARefusalIsSaid(arguments[0]);
        }
        return 0;
    }

    static void Check(bool holds, string what)
    {
        if (!holds)
        {
            throw new Exception("not so: " + what);
        }
    }

    static Triple Cross(Triple a, Triple b)
    {
        return new Triple(a.Y * b.Z - a.Z * b.Y, a.Z * b.X - a.X * b.Z, a.X * b.Y - a.Y * b.X);
    }

    static Triple Less(Triple a, Triple b)
    {
        return new Triple(a.X - b.X, a.Y - b.Y, a.Z - b.Z);
    }

    static bool Near(Triple a, Triple b, float allowed)
    {
        return Math.Abs(a.X - b.X) <= allowed && Math.Abs(a.Y - b.Y) <= allowed && Math.Abs(a.Z - b.Z) <= allowed;
    }

    // The rotation of a quaternion; the formula is the same in left- and right-handed frames.
    static Triple Turn(Rotation q, Triple v)
    {
        var u = new Triple(q.X, q.Y, q.Z);
        var t = Cross(u, v);
        t = new Triple(2 * t.X, 2 * t.Y, 2 * t.Z);
        var s = Cross(u, t);
        return new Triple(v.X + q.W * t.X + s.X, v.Y + q.W * t.Y + s.Y, v.Z + q.W * t.Z + s.Z);
    }

    static void RotationsTurnTheSameVectors()
    {
        var random = new System.Random(1);
        Func<float> any = () => (float)(2.0 * random.NextDouble() - 1.0);
        for (var trial = 0; trial < 200; trial++)
        {
            var q = new Rotation(any(), any(), any(), any());
            var length = (float)Math.Sqrt(q.X * q.X + q.Y * q.Y + q.Z * q.Z + q.W * q.W);
            q = new Rotation(q.X / length, q.Y / length, q.Z / length, q.W / length);
            var v = new Triple(any(), any(), any());
            var there = Frames.Exchange(Turn(q, v));
            var here = Turn(Frames.Exchange(q), Frames.Exchange(v));
            Check(Near(there, here, 1e-6f), "turning and exchanging, in either order");
            Check(Near(Frames.FromUnity(Frames.ToUnity(v, 0.001f), 0.001f), v, 1e-6f), "there and back");
        }
        // A needle that points along -z there points along -y here.
        Check(Near(Frames.Exchange(new Triple(0, 0, -1)), new Triple(0, -1, 0), 0f), "down");
    }

    static void TrianglesKeepTheirFront()
    {
        // Counter-clockwise seen from +z: the front is up. Unity's front is where the product of the edges points.
        var points = new[] { new Triple(0, 0, 0), new Triple(1, 0, 0), new Triple(0, 1, 0) };
        var corners = Frames.Exchange(new[] { 0, 1, 2 });
        var a = Frames.ToUnity(points[corners[0]], 1f);
        var edges = Cross(Less(Frames.ToUnity(points[corners[1]], 1f), a), Less(Frames.ToUnity(points[corners[2]], 1f), a));
        Check(edges.Y > 0, "the front of a triangle is up");
    }

    static void MessagesAreAsTheServerReadsThem()
    {
        var pose = new Pose { TipMm = new Triple(1, 2, 3), Orientation = new Rotation(0, 0, 0, 1), HasForce = true, ForceMn = new Triple(0, 0, -0.5f) };
        var bytes = Surface.Write(258, pose);
        Check(bytes.Length == 64 && bytes[4] == 1 && bytes[5] == 1 && bytes[6] == 1 && bytes[8] == 2 && bytes[9] == 1, "the header of a pose");
        Check(BitConverter.ToString(bytes, 24, 4) == "00-00-80-3F" && BitConverter.ToString(bytes, 60, 4) == "00-00-00-BF", "its numbers");
        pose.HasForce = false;
        Check(BitConverter.ToString(Surface.Write(1, pose), 60, 4) == "00-00-00-00", "no force");
        try
        {
            Surface.Read(bytes);
            Check(false, "a pose is not an answer");
        }
        catch (FormatException)
        {
        }
    }

    static void TextsAreRead()
    {
        var read = (Dictionary<string, object>)Json.Read("{\"a\": [[1, -2.5e1], []], \"b\": \"x\\\"\\u00b5\\n\", \"c\": null, \"d\": true}");
        var first = (List<object>)((List<object>)read["a"])[0];
        Check((double)first[0] == 1.0 && (double)first[1] == -25.0, "numbers");
        Check((string)read["b"] == "x\"\u00b5\n" && read["c"] == null && (bool)read["d"], "texts and words");
        foreach (var wrong in new[] { "", "{", "[1,]", "{\"a\"}", "nul", "[1] 2" })
        {
            try
            {
                Json.Read(wrong);
            }
            catch (FormatException)
            {
                continue;
            }
            Check(false, wrong + " is no JSON");
        }
        Check(Json.Quote("a\"b\\c\n") == "\"a\\\"b\\\\c\\u000a\"", "quotes");
    }

    static void Call(PressedRetina retina, string method)
    {
        typeof(PressedRetina).GetMethod(method, BindingFlags.Instance | BindingFlags.NonPublic).Invoke(retina, null);
    }

    static void UpdateUntil(PressedRetina retina, Func<bool> holds, string what)
    {
        var end = DateTime.UtcNow.AddSeconds(PatienceS);
        while (!holds())
        {
            Check(DateTime.UtcNow < end, what + "; " + retina.Problem);
            Call(retina, "Update");
            Thread.Sleep(2);
        }
    }

    static void AMeshIsPressed(string url)
    {
        var retina = new PressedRetina { url = url, level = "linear", needle = new Transform(), useForce = true };
        // The needle of the service's (0.125, -0.25, 0) mm.
        retina.needle.position = new Vector3(0.125f, 0f, -0.25f);
        Call(retina, "OnEnable");
        UpdateUntil(retina, () => retina.Latest != null, "a surface comes");
        var mesh = retina.GetComponent<MeshFilter>().mesh;
        Check(mesh.vertexCount == 64 && mesh.triangles.Length == 3 * 98, "64 nodes and 98 triangles");
        for (var at = 0; at < mesh.triangles.Length; at += 3)
        {
            Func<int, Triple> corner = k => new Triple(mesh.vertices[mesh.triangles[at + k]].x, mesh.vertices[mesh.triangles[at + k]].y, mesh.vertices[mesh.triangles[at + k]].z);
            Check(Cross(Less(corner(1), corner(0)), Less(corner(2), corner(0))).Y > 0, "every front is up");
        }
        var deepest = 0;
        for (var node = 0; node < 64; node++)
        {
            Check(mesh.normals[node].y > 0.5f, "normals are up");
            deepest = mesh.vertices[node].y < mesh.vertices[deepest].y ? node : deepest;
        }
        Console.WriteLine("pressed: {0:R} {1:R} {2:R} reaction {3:R} travel {4:R}", mesh.vertices[deepest].x, mesh.vertices[deepest].y, mesh.vertices[deepest].z, retina.ReactionMn.y, retina.Latest.TravelMm);
        // The newest pose wins, and a mesh follows.
        var before = retina.Latest.Sequence;
        for (var step = 1; step <= 50; step++)
        {
            retina.needle.position = new Vector3(0.125f - 0.005f * step, 0f, -0.25f);
            Call(retina, "Update");
        }
        UpdateUntil(retina, () => Math.Abs(retina.Latest.TipMm.X + 0.125f) < 1e-3f, "the last pose is answered");
        Check(retina.Latest.Sequence > before, "numbers go up");
        Call(retina, "OnDisable");
    }

    static void ARefusalIsSaid(string url)
    {
        Debug.Log.Clear();
        var retina = new PressedRetina { url = url, gauge = "26G", needle = new Transform() };
        Call(retina, "OnEnable");
        UpdateUntil(retina, () => Debug.Log.Count > 0, "a refusal comes");
        Check(Debug.Log[0].Contains("26G"), "it names what is wrong");
        Console.WriteLine("refused: {0}", Debug.Log[0]);
        Call(retina, "OnDisable");
    }
}
