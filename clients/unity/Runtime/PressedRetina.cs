using System;
using UnityEngine;

namespace Retina
{
    /// <summary>
    /// A retina that a needle presses: put it on an object with a MeshFilter and a MeshRenderer, give it the needle's Transform, and start the service.
    /// The patch lies in the object's x-z plane with the vitreous above; the needle is at its Transform's position and points along its -up.
    /// </summary>
    [RequireComponent(typeof(MeshFilter), typeof(MeshRenderer))]
    public sealed class PressedRetina : MonoBehaviour
    {
        [Tooltip("The stream of the service.")]
        public string url = "ws://127.0.0.1:8080/v1/stream";
        [Tooltip("Token of the service, where it wants one.")]
        public string token = "";
        [Tooltip("A scene of GET /v1/scenes.")]
        public string scene = "macula";
        [Tooltip("A needle of GET /v1/gauges.")]
        public string gauge = "25G";
        [Tooltip("hemispherical, flat or bevelled.")]
        public string tip = "hemispherical";
        [Tooltip("A level of GET /v1/levels: how accurate, and at what cost.")]
        public string level = "network";
        [Tooltip("The needle: its position is the foremost point, it points along its -up.")]
        public Transform needle;
        [Tooltip("Whether the needle advances along the force; otherwise it stays where it is and presses as deep as it stands.")]
        public bool useForce;
        [Tooltip("Force on the tissue, mN, in this object's axes: down is negative y.")]
        public Vector3 forceMn = new Vector3(0f, -0.5f, 0f);
        [Tooltip("Units of this object for a millimetre; 0.001 is true size where a unit is a metre.")]
        public float unitsPerMm = 1f;
        [Tooltip("Displacement that is drawn in the full colour, micrometres.")]
        public float fullColourUm = 100f;

        /// <summary>The newest answer, in the service's frame.</summary>
        public Surface Latest { get; private set; }

        /// <summary>Force of the tissue on the needle, mN, in this object's axes: what a haptic device renders.</summary>
        public Vector3 ReactionMn { get; private set; }

        /// <summary>Why there is no answer; null where there is.</summary>
        public string Problem { get { return stream == null ? null : stream.Problem; } }

        RetinaStream stream;
        Mesh mesh;
        Pose sent;
        bool hasSent;
        string logged;

        void OnEnable()
        {
            var session = "{\"scene\":" + Json.Quote(scene) + ",\"needle\":{\"gauge\":" + Json.Quote(gauge) + ",\"tip\":" + Json.Quote(tip)
                + "},\"accuracy\":{\"level\":" + Json.Quote(level) + "}}";
            stream = new RetinaStream(new Uri(url), token, session);
            mesh = new Mesh { name = "Retina" };
            mesh.MarkDynamic();
            GetComponent<MeshFilter>().mesh = mesh;
            hasSent = false;
        }

        void OnDisable()
        {
            stream.Dispose();
        }

        void Update()
        {
            if (needle != null)
            {
                var pose = NeedlePose();
                if (!hasSent || !pose.Equals(sent))
                {
                    stream.Send(pose);
                    sent = pose;
                    hasSent = true;
                }
            }
            var surface = stream.Take();
            if (surface != null)
            {
                Show(surface);
            }
            if (stream.Problem != logged)
            {
                logged = stream.Problem;
                if (logged != null)
                {
                    Debug.LogWarning("Retina: " + logged, this);
                }
            }
        }

        /// <summary>The needle in the service's frame.</summary>
        Pose NeedlePose()
        {
            var point = transform.InverseTransformPoint(needle.position);
            var turned = Quaternion.Inverse(transform.rotation) * needle.rotation;
            return new Pose
            {
                TipMm = Frames.FromUnity(new Triple(point.x, point.y, point.z), unitsPerMm),
                Orientation = Frames.Exchange(new Rotation(turned.x, turned.y, turned.z, turned.w)),
                HasForce = useForce,
                ForceMn = Frames.Exchange(new Triple(forceMn.x, forceMn.y, forceMn.z)),
            };
        }

        void Show(Surface surface)
        {
            var count = surface.VerticesMm.Length;
            var vertices = new Vector3[count];
            var normals = new Vector3[count];
            var colours = new Color32[count];
            for (var node = 0; node < count; node++)
            {
                vertices[node] = ToVector(Frames.ToUnity(surface.VerticesMm[node], unitsPerMm));
                normals[node] = ToVector(Frames.Exchange(surface.Normals[node]));
                var share = Mathf.Clamp01(surface.DisplacementUm[node] / fullColourUm);
                colours[node] = new Color32(255, (byte)(200 - 160 * share), (byte)(180 - 140 * share), 255);
            }
            var isNew = mesh.vertexCount != count;
            mesh.vertices = vertices;
            mesh.normals = normals;
            mesh.colors32 = colours;
            if (isNew || surface.Corners != null)
            {
                mesh.triangles = Frames.Exchange(surface.Corners ?? stream.Corners);
            }
            mesh.RecalculateBounds();
            ReactionMn = ToVector(Frames.Exchange(surface.ReactionMn));
            Latest = surface;
        }

        static Vector3 ToVector(Triple triple)
        {
            return new Vector3(triple.X, triple.Y, triple.Z);
        }
    }
}
