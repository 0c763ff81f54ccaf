// The C# binding against the library: palpate_test.exe NAME [ARGUMENTS] runs one test; 77: skipped.
using System;
using System.Collections.Generic;
using System.Diagnostics;
using System.IO;
using System.Linq;
using System.Reflection;
using System.Runtime.InteropServices;
using System.Threading;
using Palpate;

static class PalpateTest
{
    static int failures;

    sealed class Skipped : Exception { public Skipped(string why) : base(why) { } }

    static void Expect(bool holds, string what)
    {
        if (holds) return;
        ++failures;
        Console.WriteLine("FAILED: " + what);
    }

    static void Equal<T>(T found, T wanted, string what) => Expect(Equals(found, wanted), what + " is " + found + ", not " + wanted);

    static PalException Fails(PalResult result, string part, Action action)
    {
        try
        {
            action();
        }
        catch (PalException failure)
        {
            Equal(failure.Result, result, "the result of \"" + failure.Message + '"');
            Expect(failure.Message.Contains(part), '"' + failure.Message + "\" does not say: " + part);
            return failure;
        }
        Expect(false, "nothing failed with: " + part);
        return null;
    }

    static bool Comes(Func<bool> what)
    {
        for (var k = 0; k < 6000 && !what(); ++k) Thread.Sleep(10);
        return what();
    }

    static int Main(string[] arguments)
    {
        try
        {
            var test = typeof(PalpateTest).GetMethod("Test" + arguments[0], BindingFlags.Static | BindingFlags.NonPublic);
            if (test == null) throw new ArgumentException("there is no test " + arguments[0]);
            test.Invoke(null, test.GetParameters().Length == 0 ? null : new object[] { arguments.Skip(1).ToArray() });
        }
        catch (TargetInvocationException thrown) when (thrown.InnerException is Skipped)
        {
            Console.WriteLine("SKIPPED: " + thrown.InnerException.Message);
            return 77;
        }
        catch (Exception thrown)
        {
            Expect(false, (thrown is TargetInvocationException ? thrown.InnerException : thrown).ToString());
        }
        return failures == 0 ? 0 : 1;
    }

    // ---- what palpate.h declares ----

    static Type Find(string name) =>
        typeof(PalContext).Assembly.GetType("Palpate.Native+" + name) ?? typeof(PalContext).Assembly.GetType("Palpate." + name);

    /// <summary>The functions of C that are called.</summary>
    static IEnumerable<MethodInfo> Imported() => typeof(PalContext).Assembly.GetTypes()
        .SelectMany(type => type.GetMethods(BindingFlags.Static | BindingFlags.NonPublic))
        .Where(method => (method.Attributes & MethodAttributes.PinvokeImpl) != 0);

    static string Plain(string name) => name.Replace("_", "").ToLowerInvariant();

    static int SizeOf(Type type) => Marshal.SizeOf(type.IsEnum ? Enum.GetUnderlyingType(type) : type);

    /// <summary>Counts, sizes and callbacks' pointers are filled in by the constructors.</summary>
    static readonly string[] filled_in =
    {
        "size", "version", "pathcount", "modelibrarycount", "segmentationcount", "segmentcount", "framesets", "framecount",
        "sampletype", "pointcount", "capacity"
    };
    /// <summary>Of PalUnityPicture: what PalUnityPictures fills in and reads.</summary>
    static readonly string[] of_pictures = { "view", "isdone", "result", "width", "height", "sentence", "images" };

    static void TestBindsWhatTheHeaderDeclares(string[] arguments)
    {
        const BindingFlags any = BindingFlags.Instance | BindingFlags.Public | BindingFlags.NonPublic;
        var wanted = new Dictionary<string, List<string>>();
        var values = new HashSet<string>();
        var functions = new HashSet<string>();
        foreach (var line in File.ReadAllLines(arguments[0]).Select(text => text.Split(' ')))
            switch (line[0])
            {
                case "struct":
                    var type = Find(line[1]);
                    Expect(type != null, "there is no structure " + line[1]);
                    if (type == null) break;
                    wanted[line[1]] = new List<string>();
                    Equal(Marshal.SizeOf(type), int.Parse(line[2]), "the size of " + line[1]);
                    break;
                case "field":
                    var path = line[1].Split('.');
                    if (!wanted.ContainsKey(path[0])) break;
                    wanted[path[0]].Add(Plain(path[1]));
                    var field = Find(path[0]).GetFields(any).FirstOrDefault(one => Plain(one.Name) == Plain(path[1]));
                    Expect(field != null, "there is no field " + line[1]);
                    if (field == null) break;
                    Equal((int)Marshal.OffsetOf(Find(path[0]), field.Name), int.Parse(line[2]), "the offset of " + line[1]);
                    Equal(SizeOf(field.FieldType), int.Parse(line[3]), "the size of " + line[1]);
                    break;
                case "value":
                    values.Add(line[1]);
                    CheckValue(line[1], long.Parse(line[2]));
                    break;
                case "function":
                    functions.Add(line[1]);
                    var bound = Imported().Where(m => m.Name == line[1]).ToArray();
                    Expect(bound.Length > 0, "there is no function " + line[1]);
                    foreach (var one in bound) Equal(one.GetParameters().Length, int.Parse(line[2]), "the number of arguments of " + line[1]);
                    break;
            }
        Expect(wanted.Count > 20 && values.Count > 50 && functions.Count > 40, "the list of declarations is not complete");
        foreach (var name in wanted.Keys)
        {
            foreach (var field in Find(name).GetFields(any))
                Expect(wanted[name].Contains(Plain(field.Name)), name + "." + field.Name + " is not in palpate.h");
            // What a program fills in or gets is public under the same name.
            var described = typeof(PalContext).Assembly.GetType("Palpate." + name);
            Expect(described != null && described.IsPublic, name + " is not public");
            var inner = name == "PalUnityPicture" ? of_pictures : filled_in;
            foreach (var field in wanted[name].Except(inner).Except(new[] { "size", "reserved", name == "PalVulkan" ? "" : "user" }))
                Expect(described.GetMembers(BindingFlags.Instance | BindingFlags.Public).Any(member => Plain(member.Name) == field),
                    name + " has no public " + field);
        }
        foreach (var method in Imported())
            Expect(functions.Contains(method.Name), method.Name + " is not in palpate.h");
        // What the library exports, by its own list.
        var exported = File.ReadAllLines(arguments[1]).Select(text => text.Trim().TrimEnd(';')).Where(text => text.StartsWith("pal_"));
        Expect(new HashSet<string>(functions.Where(name => name.StartsWith("pal_"))).SetEquals(exported), "palpate.map and palpate.h differ");
    }

    static void CheckValue(string name, long value)
    {
        if (name == "PAL_VERSION") Equal(PalInfo.HeaderVersion, (uint)value, name);
        if (name == "PAL_VERSION") return;
        if (name == "PAL_MOST_VOLUMES") Equal(Marshal.SizeOf(typeof(PalStateVolumes)) / Marshal.SizeOf(typeof(PalStateVolume)), (int)value, name);
        if (name == "PAL_MOST_LIMITERS") Equal(Marshal.SizeOf(typeof(PalStateLimiters)) / Marshal.SizeOf(typeof(PalStateLimiter)), (int)value, name);
        if (name.StartsWith("PAL_MOST_")) return;
        foreach (var type in typeof(PalContext).Assembly.GetTypes().Where(type => type.IsEnum))
        {
            var stem = type.Name.Substring(3);
            foreach (var ending in new[] { "Flags", "Kind", "Action", "Senses", "Result", "SampleType" })
                if (stem.EndsWith(ending)) stem = stem.Substring(0, stem.Length - ending.Length);
            if (stem == "TubeField") stem = "Tube";
            foreach (var member in Enum.GetNames(type).Where(member => Plain("PAL" + stem + member) == Plain(name)))
            {
                Equal(Convert.ToInt64(Enum.Parse(type, member)), value, type.Name + "." + member);
                return;
            }
        }
        Expect(false, "there is no value " + name);
    }

    // ---- what it does ----

    static PalDeviceInfo Host() => new PalDeviceInfo { MaxForceN = 10, WorkspaceRadiusM = 1 };

    static PalSession HostSession(PalScene scene, string recording = null) =>
        new PalSession(scene, new PalSessionInfo { Flags = PalSessionFlags.HostTicks, Host = Host(), Recording = recording });

    /// <summary>A hand that waits for two seconds, while the force is ramped up, and then moves 25 mm/s along -z. Gives all forces, N.</summary>
    static List<PalVector> Press(PalSession session, double from_z_m, int ticks)
    {
        var forces = new List<PalVector>(ticks);
        var tick = new PalTick();
        for (var k = 0; k < ticks; ++k)
        {
            tick.TimeNs = 5000000000 + k * 1000000L;
            tick.PositionM.Z = from_z_m - 25e-6 * Math.Max(0, k - 2000);
            forces.Add(session.Tick(tick));
            // The writer of recordings keeps up with the real time, not with any speed.
            if (k % 100 == 0) Thread.Sleep(1);
        }
        return forces;
    }

    static PalGrid BallGrid =>
        new PalGrid(new PalCounts(32, 32, 32), new PalVector(2, 2, 2), new PalVector(-31, -31, -31));

    /// <summary>A still ball of 20 mm radius, 1000 inside and 0 outside; each frame is `more_mm` larger.</summary>
    static float[,,] Ball(int frame, double more_mm = 1.5)
    {
        var samples = new float[32, 32, 32];
        for (var k = 0; k < 32; ++k)
            for (var j = 0; j < 32; ++j)
                for (var i = 0; i < 32; ++i)
                {
                    var r = 2 * new PalVector(i - 15.5, j - 15.5, k - 15.5).Length;
                    samples[k, j, i] = (float)(1000 / (1 + Math.Exp(r - 20 - more_mm * frame)));
                }
        return samples;
    }

    /// <summary>A file with the ball, that the program reads too.</summary>
    static string WriteBall(string folder)
    {
        var path = Path.Combine(folder, "ball.mha");
        using (var file = new BinaryWriter(File.Create(path)))
        {
            file.Write(System.Text.Encoding.ASCII.GetBytes(
                "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nOffset = -31 -31 -31\n" +
                "ElementSpacing = 2 2 2\nDimSize = 32 32 32\nElementType = MET_FLOAT\nElementDataFile = LOCAL\n"));
            foreach (var sample in Ball(0)) file.Write(sample);
        }
        return path;
    }

    static PalSceneInfo BallScene(int frames = 1) => new PalSceneInfo("ball")
    {
        Frames = new[]
        {
            new PalFrames { Name = "ball", Grid = BallGrid, Frames = Enumerable.Range(0, frames).Select(f => (Array)Ball(f)).ToArray() }
        }
    };

    static void TestFeelsABall()
    {
        using (var context = new PalContext(new PalContextInfo { Flags = PalContextFlags.NoGpu }))
        using (var scene = new PalScene(context, BallScene(2)))
        using (var session = HostSession(scene))
        {
            Equal(PalInfo.Version, PalInfo.HeaderVersion, "the library's version");
            Equal(context.Device, "", "the device of no device");
            Expect(scene.GetText(PalSceneText.Json).Contains("\"modes\""), "the scene as JSON: " + scene.GetText(PalSceneText.Json));
            Expect(scene.GetVolume(0, out var volume) && volume.FrameCount == 2 && volume.IsMotionKnown == 0, "it has two frames");
            Expect(!scene.GetVolume(1, out _), "there is one volume");
            Expect(volume.HighM.X > volume.LowM.X, "its box is " + volume.LowM + " to " + volume.HighM);
            var forces = Press(session, 0.03, 2600);
            Expect(forces[1999].Length < 0.01, "before it touches the force is " + forces[1999]);
            var most = forces.Max(force => force.Z);
            Expect(most > 0.5 && most < 10, "pressed it is " + most + " N at most");
            session.GetState(out var state);
            Equal(state.Ticks, 2600UL, "the number of ticks");
            Expect(state.InContact == 1, "the hand is in contact");
            Expect(Math.Abs(state.ForceN.Z - forces[2599].Z) < 1e-12, "the newest state is the last tick's: " + state.ForceN);
            Equal(state.Cause, "", "the cause");
            Expect(state.Volumes[0].WorldFromVolume.M11 > 0 && state.VolumeCount == 1, "the state has its volume");
            Expect(state.LimiterCount > 0 && state.Limiters[0].Word.Length > 2, "the limiters have words");
            Expect(session.GetVolume(0, out var now) && now.TimeS == state.Volumes[0].TimeS, "the volume alone is the same");
            Expect(!session.GetVolume(1, out _), "there is no second volume");
            // A time that does not rise is a fault of the device: the force falls to zero by a ramp, and the cause is named.
            var tick = new PalTick { TimeNs = 1, PositionM = new PalVector(0, 0, 0.02) };
            for (var k = 0; k < 1000; ++k) session.Tick(tick);
            Equal(session.Tick(tick).Length, 0.0, "the force after a fault");
            session.GetState(out state);
            Expect(state.Cause != "" && state.CauseSentence.Length > state.Cause.Length, "the cause is named: " + state.Cause);
        }
    }

    static void TestFeelsAMeasuredHeart(string[] arguments)
    {
        var files = Directory.Exists(arguments[0]) ? Directory.GetFiles(arguments[0], "frame_*.mha") : new string[0];
        if (files.Length == 0) throw new Skipped("there are no measured frames in " + arguments[0]);
        Array.Sort(files, string.CompareOrdinal);
        using (var context = new PalContext(new PalContextInfo { Flags = PalContextFlags.NoGpu }))
        using (var scene = new PalScene(context, new PalSceneInfo(files) { Flags = PalSceneFlags.NoMotion }))
        using (var session = HostSession(scene))
        {
            Expect(scene.GetVolume(0, out var volume), "there is a volume");
            Equal(volume.FrameCount, (uint)files.Length, "the number of frames");
            Expect(scene.GetText(PalSceneText.Notes).Length > 0, "what was chosen is told");
            // Somewhere between the box's front and its middle there is a wall.
            var most = Press(session, 0.1, 5500).Max(force => force.Length);
            Expect(most > 0.3 && most < 10, "the largest force is " + most + " N");
        }
    }

    static void TestTicksWithoutAllocation()
    {
        using (var context = new PalContext(new PalContextInfo { Flags = PalContextFlags.NoGpu }))
        using (var scene = new PalScene(context, BallScene()))
        using (var session = HostSession(scene))
        {
            Press(session, 0.03, 2600);
            var tick = new PalTick { PositionM = new PalVector(0, 0, 0.015) };
            var grip = new PalGrip { Senses = PalGripSenses.Turns, DeviceFromGrip = new PalTurn(1, 0, 0, 0) };
            PalState state = default;
            session.GetState(out state);
            // The nursery of this test is 256 KiB: 30,000 objects of the least size fill it twice.
            for (var round = 0; round < 2; ++round)
            {
                var before = GC.CollectionCount(0);
                for (var k = 0; k < 30000; ++k)
                {
                    tick.TimeNs = 5000000000 + (2600 + round * 30000 + k) * 1000000L;
                    session.Hold(grip);
                    session.Tick(tick);
                    session.GetState(out state);
                }
                // The first round may compile what it needs.
                if (round == 1) Equal(GC.CollectionCount(0) - before, 0, "the number of collections in 30,000 ticks");
            }
            Expect(state.InContact == 1 && state.Shaft.Z > 0.99, "it was felt, and the grip was known: " + state.Shaft);
            var least = GC.CollectionCount(0);
            for (var k = 0; k < 30000; ++k) GC.KeepAlive(new object());
            Expect(GC.CollectionCount(0) > least, "the nursery is too large for this test");
        }
    }

    static void TestReplaysBitForBit(string[] arguments)
    {
        var folder = Path.Combine(Path.GetTempPath(), "palpate_dotnet_" + Process.GetCurrentProcess().Id);
        Directory.CreateDirectory(folder);
        try
        {
            using (var context = new PalContext(new PalContextInfo { Flags = PalContextFlags.NoGpu }))
            using (var scene = new PalScene(context, new PalSceneInfo(WriteBall(folder))))
            {
                // What a C# program felt, in the program.
                var ours = Path.Combine(folder, "ours.ticks");
                var session = HostSession(scene, ours);
                Expect(Press(session, 0.03, 2600).Max(force => force.Z) > 0.5, "it was felt");
                session.Close();
                var replayed = Run(arguments[0], "feel " + WriteBall(folder) + " --replay " + ours);
                Expect(replayed.Contains("2600 ticks: every output is the recorded one, bit by bit"), "the program says: " + replayed);
                // What the program felt, here.
                var theirs = Path.Combine(folder, "theirs.ticks");
                Run(arguments[0], "feel " + WriteBall(folder) + " --device simulated --seconds 2 --headset off --quiet --black-box off --record " + theirs);
                var replay = scene.Replay(theirs);
                Expect(replay.Ticks > 1500, "the number of ticks is " + replay.Ticks);
                Equal(replay.Different, 0UL, "the number of ticks that differ");
                Equal(replay.FirstDifferent, -1L, "the first of them");
                Equal(replay.IsCutOff, 0U, "cut off");
                var named = BallScene();
                named.Paths = new[] { named.Frames[0].Name = "another ball" };
                using (var other = new PalScene(context, named))
                    Fails(PalResult.BadInput, "another scene", () => other.Replay(theirs));
                // A recording that can not be written is told when the session is closed.
                Fails(PalResult.BadOutput, "/nowhere", () => HostSession(scene, "/nowhere/session.ticks"));
            }
        }
        finally
        {
            Directory.Delete(folder, true);
        }
    }

    static void TestReadsFramesOfFiles()
    {
        var folder = Path.Combine(Path.GetTempPath(), "palpate_frames_" + Process.GetCurrentProcess().Id);
        Directory.CreateDirectory(folder);
        try
        {
            using (var sequence = new PalSequence(new PalSequenceInfo(WriteBall(folder))))
            {
                var summary = sequence.Summary();
                Equal(summary.FrameCount, 1U, "the number of frames");
                Equal(summary.Grid.Size.Product, 32768L, "the number of samples");
                Equal(summary.Grid.SpacingMm.X, BallGrid.SpacingMm.X, "the spacing");
                var samples = sequence.Frame(0, out var time_s);
                Equal(time_s, 0.0, "the time");
                Expect(samples.SequenceEqual(Ball(0).Cast<float>()), "the samples are those of the file");
                Expect(sequence.Frame(1, out time_s) == null, "there is no other");
            }
            Fails(PalResult.BadInput, "nothing.mha", () => new PalSequence(new PalSequenceInfo("nothing.mha")));
        }
        finally
        {
            Directory.Delete(folder, true);
        }
    }

    static string Run(string program, string arguments)
    {
        var start = new ProcessStartInfo(program, arguments) { RedirectStandardOutput = true, UseShellExecute = false };
        start.EnvironmentVariables["PALPATE_COMPUTED_TIME"] = "1";
        using (var run = Process.Start(start))
        {
            var said = run.StandardOutput.ReadToEnd();
            run.WaitForExit();
            Equal(run.ExitCode, 0, "the exit code of " + arguments);
            return said;
        }
    }

    static object Forget() =>
        HostSession(new PalScene(new PalContext(new PalContextInfo { Flags = PalContextFlags.NoGpu }), BallScene()));

    static void TestSaysWhatIsWrong()
    {
        Fails(PalResult.NoDevice, "no such thing", () => new PalContext(new PalContextInfo { Device = "no such thing" }));
        Fails(PalResult.BadInput, "zero character", () => new PalContext(new PalContextInfo { Device = "a\0b" }));
        Equal(PalInfo.ResultName(PalResult.BadInput), "PAL_BAD_INPUT", "a name");
        Expect(PalInfo.Options().Contains("\"tool_radius_mm\""), "the table of options");
        var context = new PalContext(new PalContextInfo { Flags = PalContextFlags.NoGpu });
        Fails(PalResult.BadInput, "Übung.json", () => new PalScene(context, new PalSceneInfo("/nowhere/Übung.json")));
        Fails(PalResult.BadInput, "100 samples, its grid has 32768", () => new PalScene(context, new PalSceneInfo("few")
        {
            Frames = new[] { new PalFrames { Name = "few", Grid = BallGrid, Frames = new Array[] { new short[100] } } }
        }));
        Fails(PalResult.BadInput, "type Char", () => new PalScene(context, new PalSceneInfo("text")
        {
            Frames = new[] { new PalFrames { Name = "text", Grid = BallGrid, Frames = new Array[] { new char[32768] } } }
        }));
        var scene = new PalScene(context, BallScene());
        Fails(PalResult.BadInput, "max_force_n", () => new PalSession(scene, new PalSessionInfo
        {
            Flags = PalSessionFlags.HostTicks, Host = Host(), MaxForceN = 1000
        }));
        var session = HostSession(scene);
        // What was opened with them works on.
        context.Dispose();
        scene.Dispose();
        Expect(session.Tick(new PalTick { TimeNs = 1 }).Length == 0.0, "the first force is zero");
        session.Close();
        session.Close();
        try
        {
            session.Tick(new PalTick { TimeNs = 2 });
            Expect(false, "a closed session ticked");
        }
        catch (ObjectDisposedException) { }
        // Handles that nobody closes are closed when they are collected, in whatever order.
        var forgotten = Enumerable.Range(0, 8).Select(_ => new WeakReference(Forget())).ToList();
        Comes(() =>
        {
            GC.Collect();
            GC.WaitForPendingFinalizers();
            return forgotten.Count(one => one.IsAlive) < 4;
        });
        Expect(forgotten.Count(one => one.IsAlive) < 4, "forgotten sessions are collected");
    }

    static void TestSurvivesCallbacksThatThrow()
    {
        var logged = 0;
        var log = new List<string>();
        PalContext context;
        context = new PalContext(new PalContextInfo
        {
            Flags = PalContextFlags.NoGpu,
            Log = sentence =>
            {
                lock (log) log.Add(sentence);
                Interlocked.Increment(ref logged);
                throw new Exception("no room in the log");
            }
        });
        var z_m = 0.03;
        var throws = false;
        double last_n = 0, first_n = 0, busy = 0;
        var between = 0;
        var events = new List<string>();
        using (var scene = new PalScene(context, BallScene()))
        using (var session = new PalSession(scene, new PalSessionInfo
        {
            Flags = PalSessionFlags.NoRealTime,
            WatchdogS = 0.2,
            OnEvent = (kind, sentence) =>
            {
                lock (events) events.Add(sentence);
                throw new Exception("no room for events");
            },
            Device = new PalDevice
            {
                Info = Host(),
                Exchange = (PalVector force_n, ref PalReading reading) =>
                {
                    last_n = force_n.Length;
                    if (Volatile.Read(ref throws))
                    {
                        if (first_n == 0) first_n = last_n;
                        if (last_n > 0.1 * first_n && last_n < 0.9 * first_n) ++between;
                        throw new Exception("the arm is gone");
                    }
                    // Most of a tick is C#, so that collections meet it.
                    for (var k = 1; k < 20000; ++k) busy = Math.Sqrt(busy + k);
                    reading.PositionM.Z = Volatile.Read(ref z_m);
                    reading.IsFresh = 1;
                },
                Grip = (ref PalGrip grip) =>
                {
                    grip = new PalGrip { Senses = PalGripSenses.Turns, DeviceFromGrip = new PalTurn(1, 0, 0, 0) };
                }
            }
        }))
        {
            // A collection stops the haptic thread where it runs C#, and lets it go on.
            for (var k = 0; k < 50; ++k)
            {
                GC.Collect();
                Thread.Sleep(1);
            }
            for (var k = 0; k < 20000 && Volatile.Read(ref last_n) < 0.5; ++k)
            {
                Volatile.Write(ref z_m, Math.Max(0.017, 0.03 - 6e-6 * k));
                Thread.Sleep(1);
            }
            Expect(Volatile.Read(ref last_n) >= 0.5, "the ball is felt: " + last_n);
            session.GetState(out var state);
            Expect(state.Shaft.Z > 0.99, "the grip is known: " + state.Shaft);
            Volatile.Write(ref throws, true);
            Expect(Comes(() => { lock (events) return events.Contains("exchange threw an exception: the arm is gone"); }), "an event reports it");
            Expect(Comes(() => Volatile.Read(ref last_n) == 0), "the force goes to zero");
            Expect(between > 3, "by a ramp: " + between + " steps of it");
            session.GetState(out state);
            Expect(state.Cause != "", "the cause is named");
            Expect(Comes(() => { lock (log) return log.Contains("on_event threw an exception: no room for events"); }), "the log reports the event's exception");
        }
        Expect(logged > 0, "the log was called");
    }

    static void TestEstimatesMotion()
    {
        PalContext context;
        try
        {
            context = new PalContext();
        }
        catch (PalException failure) when (failure.Result == PalResult.NoDevice)
        {
            throw new Skipped(failure.Message);
        }
        var info = new PalEstimatorInfo { Grid = BallGrid, Preset = "fast", Mask = Enumerable.Repeat((byte)1, 32768).ToArray() };
        double told = 0;
        info.OnProgress = (doing, share) => told = doing.Length > 0 ? share : -1;
        PalMotion motion;
        using (var estimator = new PalEstimator(context, info))
        {
            estimator.Push(Ball(0));
            estimator.Push(Ball(1));
            motion = estimator.Finish();
            Equal(estimator.Poll().IsFinished, 1U, "finished");
            Fails(PalResult.BadInput, "100 samples", () => estimator.Push(new float[100]));
        }
        Expect(told > 0, "the progress was told");
        var summary = motion.Summary();
        Equal(summary.FrameCount, 2U, "the number of frames");
        Expect(summary.TrustWord == "ok" && summary.Trust == PalTrust.Ok, "the verdict is " + summary.TrustWord + ": " + summary.Reasons);
        // The ball grows by 1.5 mm: its wall at +x, 20 mm from the middle, moves along +x.
        var field = motion.Field();
        Equal(field.Length, 3 * 32768, "the length of the field");
        var wall = 3 * (25 + 32 * (15 + 32 * 16));
        Expect(Math.Abs(field[wall] - 1.5) < 0.5, "u at the wall is " + field[wall] + ", " + field[wall + 1] + ", " + field[wall + 2]);
        var small = new PalGrid(new PalCounts(1, 1, 1), new PalVector(1, 1, 1), new PalVector(-31 + 50, -1, 1));
        var one = motion.Field(new PalFieldInfo { Grid = small });
        Expect(one.Length == 3 && Math.Abs(one[0] - field[wall]) < 1e-3, "at that place alone it is " + one[0]);
        Expect(motion.Confidence().All(value => value >= 0 && value <= 1), "the confidence is 0 to 1");
        var warped = motion.Warp(Ball(1));
        var fixed_frame = Ball(0).Cast<float>().ToArray();
        var before = Ball(1).Cast<float>().Zip(fixed_frame, (a, b) => Math.Abs(a - b)).Average();
        Expect(warped.Zip(fixed_frame, (a, b) => Math.Abs(a - b)).Average() < 0.4 * before, "the warped frame is the fixed one");
        // Known motion is part of a scene.
        var moving = BallScene(2);
        moving.Flags = PalSceneFlags.NotCyclic;
        moving.Frames[0].Motion = motion;
        using (var scene = new PalScene(context, moving))
        {
            motion.Dispose();
            Expect(scene.GetVolume(0, out var volume) && volume.IsMotionKnown == 1, "the scene knows its motion");
        }
        // An exception from on_progress stops the estimation, and comes back.
        info.OnProgress = (doing, share) => throw new InvalidOperationException("the window is closed");
        using (var estimator = new PalEstimator(context, info))
        {
            estimator.Push(Ball(0));
            var failure = Fails(PalResult.Cancelled, "the window is closed", () =>
            {
                estimator.Push(Ball(1));
                estimator.Finish();
            });
            Expect(failure?.InnerException is InvalidOperationException, "the exception is inside");
        }
        context.Dispose();
    }

    static void TestDrawsPictures()
    {
        PalContext context;
        try
        {
            context = new PalContext();
        }
        catch (PalException failure) when (failure.Result == PalResult.NoDevice)
        {
            throw new Skipped(failure.Message);
        }
        using (context)
        using (var scene = new PalScene(context, BallScene()))
        using (var session = HostSession(scene))
        using (var view = new PalView(session, new PalViewInfo { Width = 64, Height = 48, Flags = PalViewFlags.NoHand | PalViewFlags.NoBox }))
        {
            var eye = new[]
            {
                new PalEye
                {
                    PositionM = new PalVector(0, 0, 0.3), Orientation = new PalQuaternion(0, 0, 0, 1), TanLeft = -0.3, TanRight = 0.3,
                    TanDown = -0.25, TanUp = 0.25
                }
            };
            Expect(!view.Render(eye, 64, 48), "before the first tick there is no picture");
            session.Tick(new PalTick { TimeNs = 1, PositionM = new PalVector(0, 0, 0.08) });
            Expect(view.Render(eye, 64, 48), "there is a picture");
            var pixels = new uint[64 * 48];
            var depth_m = new float[64 * 48];
            view.Read(0, pixels, depth_m);
            Expect(pixels[24 * 64 + 32] >> 24 > 100, "the opacity in the middle is " + (pixels[24 * 64 + 32] >> 24));
            Expect(Math.Abs(depth_m[24 * 64 + 32] - 0.3) < 0.02, "the depth in the middle is " + depth_m[24 * 64 + 32]);
            Equal(depth_m[0], 0F, "the depth in the corner");
            Fails(PalResult.BadInput, "3072 pixels", () => view.Read(0, new uint[3000], null));
            Fails(PalResult.BadInput, "", () => view.Read(1, pixels, null));
        }
    }

    // ---- the sample for Unity, with a stub of its classes ----

    static void Send(object script, string message) =>
        script.GetType().GetMethod(message, BindingFlags.Instance | BindingFlags.NonPublic).Invoke(script, null);

    static void TestMovesAHandInUnity()
    {
        var folder = Path.Combine(Path.GetTempPath(), "palpate_unity_" + Process.GetCurrentProcess().Id);
        Directory.CreateDirectory(folder);
        try
        {
            var hand = new PalpateHand { scene = WriteBall(folder), hand = new UnityEngine.Transform(), proxy = new UnityEngine.Transform() };
            Send(hand, "OnEnable");
            Expect(hand.Session != null, "it runs: " + string.Join("; ", UnityEngine.Debug.Said));
            Expect(Comes(() =>
            {
                Send(hand, "Update");
                return hand.InContact && Math.Abs(hand.ForceN.x) + Math.Abs(hand.ForceN.y) + Math.Abs(hand.ForceN.z) > 0.3;
            }), "the simulated hand presses the ball: " + hand.ForceN.z + " N, " + hand.Cause);
            // Unity's z points away from the user: the hand comes from there with a negative z, and is pushed back to it.
            Expect(hand.hand.localPosition.z < 0 && hand.ForceN.z < 0, "z is turned: " + hand.hand.localPosition.z + ", " + hand.ForceN.z);
            Send(hand, "OnDisable");
            Expect(hand.Session == null, "it ends");
            hand.scene = "/nowhere/scene.json";
            Send(hand, "OnEnable");
            Expect(UnityEngine.Debug.Said.Any(line => line.StartsWith("error: ") && line.Contains("/nowhere/scene.json")), "a wrong scene is told");
            Send(hand, "Update");
            // Without Unity its plugin has no device, and says so.
            hand.isDrawn = true;
            UnityEngine.Debug.Said.Clear();
            Send(hand, "OnEnable");
            Equal(string.Join("; ", UnityEngine.Debug.Said), "error: The plugin was not loaded by Unity", "what is told");
        }
        finally
        {
            Directory.Delete(folder, true);
        }
    }

    static void TestShowsACameraInUnity()
    {
        PalContext context;
        try
        {
            context = new PalContext();
        }
        catch (PalException failure) when (failure.Result == PalResult.NoDevice)
        {
            throw new Skipped(failure.Message);
        }
        var session = HostSession(new PalScene(context, BallScene()));
        var hand = new PalpateHand();
        typeof(PalpateHand).GetProperty("Session").SetValue(hand, session);
        var camera = new UnityEngine.Camera
        {
            targetTexture = new UnityEngine.RenderTexture
            {
                width = 80, height = 40, colorBuffer = new UnityEngine.RenderBuffer { Native = new IntPtr(16) },
                depthBuffer = new UnityEngine.RenderBuffer { Native = new IntPtr(32) }
            }
        };
        camera.transform.position = new UnityEngine.Vector3(1, 2, 3);
        // A turn about y that lets the camera look to the right in Unity, along +x, and so does the eye in palpate's world.
        camera.transform.rotation = new UnityEngine.Quaternion { y = (float)Math.Sqrt(0.5), w = (float)Math.Sqrt(0.5) };
        var script = new PalpateCamera { hand = hand };
        script.Others.Add(camera);
        Send(script, "Start");
        var slots = new HashSet<IntPtr>();
        for (var k = 0; k < 6; ++k)
        {
            Send(script, "OnPreRender");
            foreach (var slot in camera.Buffers[0].Data) slots.Add(slot);
        }
        Equal(UnityEngine.Debug.Said.Count, 0, "the number of messages");
        Equal(slots.Count, 4, "the number of pictures that wait for a render thread that never comes");
        Equal(camera.Buffers[0].Data.Count, 0, "the number of events when all wait");
        var picture = (PalUnityPicture)Marshal.PtrToStructure(slots.First(), typeof(PalUnityPicture));
        var eye = picture.Eyes.First;
        Expect(eye.PositionM.X == 1 && eye.PositionM.Y == 2 && eye.PositionM.Z == -3, "the eye is at " + eye.PositionM);
        // Minus z, turned by the eye's quaternion.
        var q = eye.Orientation;
        var forward = new PalVector(-2 * (q.X * q.Z + q.W * q.Y), -2 * (q.Y * q.Z - q.W * q.X), -(1 - 2 * (q.X * q.X + q.Y * q.Y)));
        Expect(Math.Abs(forward.X - 1) < 1e-6 && Math.Abs(forward.Z) < 1e-6, "it looks along " + forward);
        Expect(Math.Abs(eye.TanUp - Math.Tan(Math.PI / 6)) < 1e-6 && Math.Abs(eye.TanRight - 2 * eye.TanUp) < 1e-6, "its angles");
        Expect(picture.Colour.First == new IntPtr(16) && picture.Depth.First == new IntPtr(32), "its images");
        Expect(Math.Abs(picture.InverseDepth0 - 0.2) < 1e-6 && Math.Abs(picture.InverseDepth1 - 50) < 1e-4, "depth is reversed");
        // Another image needs another view, which is made when the render thread has drawn the pictures of the last one.
        camera.targetTexture = new UnityEngine.RenderTexture { width = 160, height = 40 };
        Send(script, "OnPreRender");
        Equal(camera.Buffers[0].Data.Count, 0, "the number of events while the last view is used");
        foreach (var slot in slots) Marshal.WriteInt32(slot, (int)Marshal.OffsetOf(typeof(PalUnityPicture), "isDone"), 1);
        Send(script, "OnPreRender");
        Equal(camera.Buffers[0].Data.Count, 1, "the number of events with the new view");
        // A picture that failed stops the camera, with the plugin's sentence.
        var first = camera.Buffers[0].Data[0];
        for (var k = 0; k < 4; ++k)
        {
            Marshal.WriteInt32(first, (int)Marshal.OffsetOf(typeof(PalUnityPicture), "isDone"), 1);
            Marshal.WriteInt32(first, (int)Marshal.OffsetOf(typeof(PalUnityPicture), "result"), (int)PalResult.BadInput);
            var sentence = System.Text.Encoding.UTF8.GetBytes("no such image\0");
            Marshal.Copy(sentence, 0, IntPtr.Add(first, (int)Marshal.OffsetOf(typeof(PalUnityPicture), "sentence")), sentence.Length);
            Send(script, "OnPreRender");
        }
        Equal(string.Join("; ", UnityEngine.Debug.Said), "error: no such image", "what is told");
        Expect(!script.enabled, "the camera's script is off");
        Send(script, "OnDestroy");
        session.Dispose();
    }
}
