using System;
using System.Collections.Generic;
using System.IO;
using System.Net.WebSockets;
using System.Text;
using System.Threading;
using System.Threading.Tasks;

namespace Retina
{
    /// <summary>
    /// A stream to the service: poses go as they come, the newest one first and alone, and the newest surface is there to be taken. It works on
    /// threads of its own and never holds up the one that draws. It knows nothing of Unity.
    /// </summary>
    public sealed class RetinaStream : IDisposable
    {
        const int PieceBytes = 16 * 1024;

        readonly CancellationTokenSource ends = new CancellationTokenSource();
        readonly SemaphoreSlim posed = new SemaphoreSlim(0, 1);
        readonly object gate = new object();
        readonly ArraySegment<byte> piece = new ArraySegment<byte>(new byte[PieceBytes]);
        Pose? newestPose;
        Surface newestSurface;
        int[] corners;
        string problem;

        /// <summary>Opens a stream at ws://host:port/v1/stream; the session is the JSON of what a stream is opened with, its scene at least, without the format.</summary>
        public RetinaStream(Uri address, string token, string session)
        {
            Task.Run(() => Run(address, token, session));
        }

        /// <summary>Corners of the triangles of every surface, service's frame; null until the session is open, empty for a mesh.</summary>
        public int[] Corners
        {
            get { lock (gate) { return corners; } }
        }

        /// <summary>What the service or the connection last said no with; null where all is well.</summary>
        public string Problem
        {
            get { lock (gate) { return problem; } }
        }

        /// <summary>Gives the needle's pose; it takes the place of one that has not gone yet.</summary>
        public void Send(Pose pose)
        {
            lock (gate)
            {
                newestPose = pose;
                if (posed.CurrentCount == 0)
                {
                    posed.Release();
                }
            }
        }

        /// <summary>The newest surface, if there is one that was not taken yet.</summary>
        public Surface Take()
        {
            lock (gate)
            {
                var surface = newestSurface;
                newestSurface = null;
                return surface;
            }
        }

        public void Dispose()
        {
            ends.Cancel();
        }

        async Task Run(Uri address, string token, string session)
        {
            try
            {
                using (var socket = new ClientWebSocket())
                {
                    if (!string.IsNullOrEmpty(token))
                    {
                        socket.Options.SetRequestHeader("Authorization", "Bearer " + token);
                    }
                    await socket.ConnectAsync(address, ends.Token);
                    var open = "{\"open\":" + session.Substring(0, session.LastIndexOf('}')) + ",\"format\":\"binary\"}}";
                    await Send(socket, Encoding.UTF8.GetBytes(open), WebSocketMessageType.Text);
                    // What refuses the session is the last word: poses without one would only be refused in turn.
                    if (!TakeText(Encoding.UTF8.GetString((await Receive(socket)).Value)))
                    {
                        return;
                    }
                    var sending = SendPoses(socket);
                    await ReceiveSurfaces(socket);
                    ends.Cancel();
                    await sending;
                }
            }
            catch (OperationCanceledException)
            {
                // Disposed.
            }
            catch (Exception error)
            {
                Told(error.Message);
            }
        }

        async Task SendPoses(ClientWebSocket socket)
        {
            ulong sequence = 0;
            while (!ends.IsCancellationRequested)
            {
                await posed.WaitAsync(ends.Token);
                Pose? pose;
                lock (gate)
                {
                    pose = newestPose;
                    newestPose = null;
                }
                if (pose.HasValue)
                {
                    sequence++;
                    await Send(socket, Surface.Write(sequence, pose.Value), WebSocketMessageType.Binary);
                }
            }
        }

        Task Send(ClientWebSocket socket, byte[] bytes, WebSocketMessageType kind)
        {
            return socket.SendAsync(new ArraySegment<byte>(bytes), kind, true, ends.Token);
        }

        async Task ReceiveSurfaces(ClientWebSocket socket)
        {
            while (true)
            {
                var message = await Receive(socket);
                if (message.Key == WebSocketMessageType.Close)
                {
                    Told("the service has closed the stream: " + Encoding.UTF8.GetString(message.Value));
                    return;
                }
                if (message.Key == WebSocketMessageType.Binary)
                {
                    var surface = Surface.Read(message.Value);
                    lock (gate)
                    {
                        newestSurface = surface;
                        problem = null;
                    }
                }
                else
                {
                    TakeText(Encoding.UTF8.GetString(message.Value));
                }
            }
        }

        /// <summary>The next whole message; that of a farewell is its reason.</summary>
        async Task<KeyValuePair<WebSocketMessageType, byte[]>> Receive(ClientWebSocket socket)
        {
            using (var message = new MemoryStream())
            {
                WebSocketReceiveResult result;
                do
                {
                    result = await socket.ReceiveAsync(piece, ends.Token);
                    message.Write(piece.Array, 0, result.Count);
                }
                while (!result.EndOfMessage);
                var isClose = result.MessageType == WebSocketMessageType.Close;
                var bytes = isClose ? Encoding.UTF8.GetBytes(result.CloseStatusDescription ?? "") : message.ToArray();
                return new KeyValuePair<WebSocketMessageType, byte[]>(result.MessageType, bytes);
            }
        }

        /// <summary>Takes in a text; false for a problem.</summary>
        bool TakeText(string text)
        {
            var message = (Dictionary<string, object>)Json.Read(text);
            object part;
            if (message.TryGetValue("opened", out part))
            {
                var triangles = (List<object>)((Dictionary<string, object>)part)["triangles"];
                var read = new List<int>();
                foreach (List<object> triangle in triangles)
                {
                    foreach (double corner in triangle)
                    {
                        read.Add((int)corner);
                    }
                }
                lock (gate)
                {
                    corners = read.ToArray();
                }
                return true;
            }
            if (message.TryGetValue("problem", out part))
            {
                var document = (Dictionary<string, object>)((Dictionary<string, object>)part)["problem"];
                Told((string)document["detail"]);
            }
            return false;
        }

        void Told(string what)
        {
            lock (gate)
            {
                problem = what;
            }
        }
    }
}
