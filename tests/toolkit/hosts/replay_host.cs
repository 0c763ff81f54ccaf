// A host in C#: replays a recording of a scene with a known motion, and draws its first frame.
// usage: replay_host.exe FIELDS RECORDING PICTURE.ppm SIZE EYE TURN FRAME...; EYE: x,y,z in m; TURN: a quaternion x,y,z,w
// Prints a JSON object.
using System;
using System.Globalization;
using System.IO;
using System.Linq;
using System.Text;
using Palpate;

static class ReplayHost
{
    static double[] Numbers(string text) => text.Split(',').Select(part => double.Parse(part, CultureInfo.InvariantCulture)).ToArray();

    static void Main(string[] arguments)
    {
        using (var context = new PalContext())
        using (var scene = new PalScene(context, new PalSceneInfo(arguments.Skip(6).ToArray()) { Fields = arguments[0] }))
        {
            var replay = scene.Replay(arguments[1]);
            Draw(scene, arguments[2], uint.Parse(arguments[3]), Numbers(arguments[4]), Numbers(arguments[5]));
            Console.WriteLine("{\"ticks\": " + replay.Ticks + ", \"different\": " + replay.Different + "}");
        }
    }

    static void Draw(PalScene scene, string file, uint size, double[] eye_m, double[] turn)
    {
        var tan = Math.Tan(0.5 * 0.55);
        var eye = new[]
        {
            new PalEye
            {
                PositionM = new PalVector(eye_m[0], eye_m[1], eye_m[2]), Orientation = new PalQuaternion(turn[0], turn[1], turn[2], turn[3]),
                TanLeft = -tan, TanRight = tan, TanDown = -tan, TanUp = tan
            }
        };
        var device = new PalDeviceInfo { Name = "test", MaxForceN = 8, MaxStiffnessNPerM = 3000, WorkspaceRadiusM = 0.2 };
        using (var session = new PalSession(scene, new PalSessionInfo { Flags = PalSessionFlags.HostTicks, Host = device }))
        using (var view = new PalView(session, new PalViewInfo { Width = size, Height = size, Flags = PalViewFlags.NoHand }))
        using (var stream = File.Create(file))
        {
            session.Play(false);
            session.Scrub(0.0);
            session.Tick(new PalTick { TimeNs = 1, PositionM = new PalVector(0, 0, 0.09) });
            view.Render(eye, size, size);
            var pixels = new uint[size * size];
            view.Read(0, pixels, null);
            var header = Encoding.ASCII.GetBytes("P6\n" + size + " " + size + "\n255\n");
            stream.Write(header, 0, header.Length);
            foreach (var pixel in pixels)
                for (var channel = 0; channel < 3; ++channel) stream.WriteByte((byte)(pixel >> 8 * channel));
        }
    }
}
