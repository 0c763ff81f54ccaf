// Palpate.cs: the C library of palpate for .NET Standard 2.0, Mono and Unity. C# 7.2, no unsafe code.
//
// palpate.h describes every function and field; here they have the same names: pal_scene_open() is the constructor of
// PalScene, the field max_force_n is MaxForceN. What differs from C:
// - The size and the version of a structure are filled in. Strings are UTF-8 in C.
// - A failure is a PalException with the library's sentence and its PalResult. "Not yet" is the result false.
// - Each handle is a SafeHandle. What was opened with it works on when it is closed: the order of Dispose() does not matter.
// - An exception in a callback never reaches the library: see the delegates. A callback lives as long as its object, and
//   an object whose callback refers to it is not collected: dispose of it.
// - Units and frames are those of palpate.h: haptics m, N, s in the device's space (x right, y up, z towards the user); the
//   world m, right-handed, y up (Unity's world is left-handed: negate z); grids and fields mm, LPS.
// - Threads: as in palpate.h. PalSession.Tick() allocates nothing. A garbage collection stops every thread that runs C#.
using System;
using System.Collections.Concurrent;
using System.Collections.Generic;
using System.Runtime.InteropServices;
using System.Text;
using System.Threading;

namespace Palpate
{
    // ---- results and values ----

    /// <summary>Below 0: a failure; above 0: "not yet" or "no more".</summary>
    public enum PalResult
    {
        Ok = 0, NotYet = 1, End = 2, BadInput = -1, BadOutput = -2, NoDevice = -3, DeviceFailed = -4, OutOfMemory = -5,
        Cancelled = -6, BadVersion = -7, Internal = -8
    }

    public enum PalSampleType
    {
        Float32 = 0, Float64 = 1, Int8 = 2, Uint8 = 3, Int16 = 4, Uint16 = 5, Int32 = 6, Uint32 = 7
    }

    [Flags] public enum PalContextFlags : uint { None = 0, NoGpu = 1 }
    [Flags] public enum PalEstimatorFlags : uint { None = 0, Pairwise = 1, Cyclic = 2, NoVerdict = 4 }
    [Flags] public enum PalFieldFlags : uint { None = 0, ToTime = 1, Inverse = 2 }
    [Flags]
    public enum PalSceneFlags : uint
    {
        None = 0, Movable = 1, TrueSize = 2, NotCyclic = 4, Live = 8, NoMotion = 16, ForgetMotion = 32
    }
    [Flags] public enum PalSessionFlags : uint { None = 0, HostTicks = 1, NoEstimation = 2, NoRealTime = 4, DeadMan = 8, Follow = 16 }
    [Flags] public enum PalViewFlags : uint { None = 0, NoHand = 1, NoBox = 2, CutOpen = 4, NoBackground = 8, NoShadows = 16 }
    [Flags] public enum PalGripSenses : uint { None = 0, Turns = 1, Opens = 2 }

    public enum PalTrust { Unknown = 0, Ok = 1, Suspect = 2, Failed = 3 }
    public enum PalSceneText { Notes = 0, Plan = 1, Json = 2 }
    public enum PalEventKind { Note = 0, Moves = 1, WholeMotion = 2, MotionFailed = 3 }
    public enum PalTubesAction { Release = 0, Keep = 1, Clear = 2 }
    public enum PalTubeField { Vectors = 0, Gradient = 1, Curl = 2, Velocity = 3 }
    public enum PalFault : uint { None = 0, NotOpened = 1, Unplugged = 2, Timeout = 3, Garbage = 4, NotHomed = 5, ForceOff = 6 }

    /// <summary>A failure: Message is the library's sentence, which says what to change.</summary>
    public sealed class PalException : Exception
    {
        public PalException(PalResult result, string sentence, Exception cause = null) : base(sentence, cause) { Result = result; }
        public PalResult Result { get; }
    }

    /// <summary>Three numbers along x, y, z; unit and frame are those of the member.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PalVector
    {
        public double X, Y, Z;
        public PalVector(double x, double y, double z) { X = x; Y = y; Z = z; }
        public double Length => Math.Sqrt(X * X + Y * Y + Z * Z);
        public override string ToString() => FormattableString.Invariant($"({X}, {Y}, {Z})");
    }

    /// <summary>The numbers of samples along i, j, k.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PalCounts
    {
        public uint I, J, K;
        public PalCounts(uint i, uint j, uint k) { I = i; J = j; K = k; }
        public long Product => (long)I * J * K;
    }

    /// <summary>Three rows of a rotation matrix; all 0: the identity.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PalDirection { public double M00, M01, M02, M10, M11, M12, M20, M21, M22; }

    /// <summary>Three rows of four: rotation with scales, and translation (M03, M13, M23) in m.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PalPose
    {
        public double M00, M01, M02, M03, M10, M11, M12, M13, M20, M21, M22, M23;
        public static PalPose Identity => new PalPose { M00 = 1, M11 = 1, M22 = 1 };
    }

    /// <summary>A unit quaternion in the order of PalEye: x, y, z, w.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PalQuaternion
    {
        public double X, Y, Z, W;
        public PalQuaternion(double x, double y, double z, double w) { X = x; Y = y; Z = z; W = w; }
    }

    /// <summary>A unit quaternion in the order of PalGrip: w, x, y, z.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PalTurn
    {
        public double W, X, Y, Z;
        public PalTurn(double w, double x, double y, double z) { W = w; X = x; Y = y; Z = z; }
    }

    /// <summary>Positions of samples, LPS, mm: sample (i, j, k) is at Origin + Direction * (Spacing * (i, j, k)); x fastest.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PalGrid
    {
        public PalCounts Size;
        public PalVector SpacingMm, OriginMm;
        public PalDirection Direction;
        public PalGrid(PalCounts size, PalVector spacing_mm, PalVector origin_mm) : this()
        {
            Size = size;
            SpacingMm = spacing_mm;
            OriginMm = origin_mm;
        }
    }

    /// <summary>The progress of an estimator; Share is 0 to 1.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PalProgress
    {
        internal uint size;
        public uint FramesPushed, StepsFound, IsFinished;
        public double Share;
    }

    /// <summary>A volume of a scene; box and pose in m.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PalVolume
    {
        internal uint size;
        public uint FrameCount;
        public double LengthS;
        public PalVector LowM, HighM;
        public PalPose WorldFromVolume;
        public uint IsMotionKnown, IsMovable;
        /// <summary>The box that its data fill, along their own axes: a corner, and from there an edge in each row of EdgesM.</summary>
        public PalVector CornerM;
        public PalDirection EdgesM;
    }

    /// <summary>The result of a replay; Different is the number of ticks that differ in any bit.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PalReplay
    {
        internal uint size;
        public uint IsCutOff;
        public ulong Ticks, Different;
        public long FirstDifferent;
    }

    /// <summary>A reading of a device: position in m, device space; time of CLOCK_MONOTONIC in ns, 0: now.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PalReading
    {
        public PalVector PositionM;
        public long TimeNs;
        public uint Buttons;
        public PalFault Fault;
        public uint IsFresh;
    }

    /// <summary>How a grip is held: rotation w, x, y, z; rad/s along the device's axes; rad.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PalGrip
    {
        internal uint size;
        public PalGripSenses Senses;
        public PalTurn DeviceFromGrip;
        public PalVector AngularVelocityRadPerS;
        public double OpeningRad;
    }

    /// <summary>One haptic frame's input: position in m, device space; time in ns by a clock that never jumps, 0: now.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PalTick
    {
        public PalVector PositionM;
        public long TimeNs;
        public uint Buttons;
    }

    /// <summary>A volume in PalState: pose in m, time of its sequence in s, rate in s per s.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PalStateVolume
    {
        public PalPose WorldFromVolume;
        public double TimeS, Rate;
    }

    /// <summary>A limiter in PalState: what it held back, N, world.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PalStateLimiter
    {
        internal IntPtr word;
        public PalVector HeldN;
        /// <summary>docs/force-limits.md explains each.</summary>
        public string Word => Text.Static(word);
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct PalStateVolumes
    {
        internal PalStateVolume v0, v1, v2, v3, v4, v5, v6, v7;
        public PalStateVolume this[int index]
        {
            get
            {
                switch (index)
                {
                    case 0: return v0; case 1: return v1; case 2: return v2; case 3: return v3;
                    case 4: return v4; case 5: return v5; case 6: return v6; case 7: return v7;
                    default: throw new ArgumentOutOfRangeException(nameof(index));
                }
            }
        }
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct PalStateLimiters
    {
        internal PalStateLimiter l0, l1, l2, l3, l4, l5, l6, l7, l8, l9, l10, l11, l12, l13, l14, l15;
        public PalStateLimiter this[int index]
        {
            get
            {
                switch (index)
                {
                    case 0: return l0; case 1: return l1; case 2: return l2; case 3: return l3;
                    case 4: return l4; case 5: return l5; case 6: return l6; case 7: return l7;
                    case 8: return l8; case 9: return l9; case 10: return l10; case 11: return l11;
                    case 12: return l12; case 13: return l13; case 14: return l14; case 15: return l15;
                    default: throw new ArgumentOutOfRangeException(nameof(index));
                }
            }
        }
    }

    /// <summary>The newest haptic frame: m and N along the world's axes.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PalState
    {
        internal uint size;
        public uint InContact;
        public long TimeNs;
        public PalVector HandM, ProxyM, ForceN;
        internal IntPtr cause, causeSentence;
        public uint CanPlay, Steps, StepsKnown, VolumeCount;
        public PalStateVolumes Volumes;
        public ulong Ticks, LateTicks, FramesReceived, FramesFelt;
        public double FrameDelayS, FrameCycleS, HandWorkJ;
        public PalVector AskedN;
        public uint LimiterCount;
        internal uint reserved;
        public PalStateLimiters Limiters;
        public PalVector Shaft;
        public PalVector TorqueNM;
        /// <summary>Why the force is not the scene's, as a word ("late"), or "".</summary>
        public string Cause => Text.Static(cause);
        public string CauseSentence => Text.Static(causeSentence);
    }

    /// <summary>A volume as it is in the newest haptic frame: pose in m, time in s, rate in s per s.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PalVolumeState
    {
        internal uint size, reserved;
        public PalPose WorldFromVolume;
        public double TimeS, Rate;
    }

    /// <summary>An eye as in OpenXR: m, world; it looks along its -z; tangents of the angles of view.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PalEye
    {
        public PalVector PositionM;
        public PalQuaternion Orientation;
        public double TanLeft, TanRight, TanDown, TanUp;
    }

    /// <summary>One value for each of two eyes.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PalEyeHandles { public ulong First, Second; }
    /// <summary>One value for each of two eyes.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PalEyeLayers { public uint First, Second; }

    /// <summary>The host's images on the Vulkan device that the context shares; handles and enumerations are Vulkan's, 1/m.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PalImages
    {
        internal uint size;
        public uint WritesDepth;
        public PalEyeHandles Colour, Depth;
        public PalEyeLayers ColourLayer, DepthLayer;
        public uint ColourFormat, DepthFormat, ColourLayout, DepthLayout;
        public double InverseDepth0, InverseDepth1;
    }

    // ---- callbacks ----

    /// <summary>A sentence on what the library does, on any thread. An exception is dropped.</summary>
    public delegate void PalLog(string sentence);
    /// <summary>On the estimator's threads; share 0 to 1. An exception cancels the estimation; Finish() throws it inside its own.</summary>
    public delegate void PalOnProgress(string doing, double share);
    /// <summary>On the session's threads; must not close the session. An exception goes to the context's log.</summary>
    public delegate void PalOnEvent(PalEventKind kind, string sentence);
    /// <summary>About 1,000 times a second on palpate's haptic thread: sends force_n (N, device space) and fills in the newest
    /// reading. An exception counts as a fault of the device: the force goes to zero by a ramp, and an event of kind Note
    /// reports the first one. A garbage collection delays this call: a host that can call Tick() itself should do that.</summary>
    public delegate void PalExchange(PalVector force_n, ref PalReading reading);
    /// <summary>How the grip is held, after each exchange. An exception counts as in PalExchange.</summary>
    public delegate void PalGripRead(ref PalGrip grip);
    /// <summary>Before each exchange: the torque on the grip, N m, that belongs to its force; at most Info.MaxTorqueNM, which must be above
    /// 0. An exception counts as in PalExchange.</summary>
    public delegate void PalTorqueSend(PalVector torque_n_m);

    // ---- descriptions: what a constructor takes; 0, null and false: the library chooses ----

    /// <summary>A Vulkan device of the host; handles are Vulkan's. The callbacks are addresses of C functions, since an exception
    /// could not keep the library from the queue; both IntPtr.Zero: only the library uses the queue.</summary>
    public sealed class PalVulkan
    {
        public uint QueueFamily;
        public IntPtr Instance, PhysicalDevice, Device, Queue;
        public bool HasExtendedFormats;
        public IntPtr LockQueue, UnlockQueue, User;
    }

    public sealed class PalContextInfo
    {
        public PalContextFlags Flags;
        public string Device;
        public PalVulkan Vulkan;
        public ulong MemoryCapBytes;
        public PalLog Log;
    }

    public sealed class PalEstimatorInfo
    {
        public PalEstimatorFlags Flags;
        public PalGrid Grid;
        /// <summary>"fast", "balanced", "best" or "classic".</summary>
        public string Preset;
        /// <summary>A byte per sample of the grid; 0: it does not count.</summary>
        public byte[] Mask;
        public PalOnProgress OnProgress;
        public uint Iterations;
    }

    public sealed class PalFieldInfo
    {
        public PalFieldFlags Flags;
        public uint Step;
        public double TimeS;
        /// <summary>Null: the frames' grid.</summary>
        public PalGrid? Grid;
    }

    /// <summary>Frames in memory. Each array has as many elements as the grid has samples, x fastest, such as float[nz, ny, nx];
    /// all of one of the types of PalSampleType.</summary>
    public sealed class PalFrames
    {
        public string Name;
        public PalGrid Grid;
        public IList<Array> Frames;
        public double[] TimesS;
        public PalMotion Motion;
    }

    public sealed class PalSceneInfo
    {
        public PalSceneInfo(params string[] paths) { Paths = paths; }
        public PalSceneFlags Flags;
        public IList<string> Paths;
        public string Json, Folder;
        public IList<PalFrames> Frames;
        public IList<string> ModeLibraries;
        public double? IsoValue;
        public double StrengthN, Friction, FramesPerSecond;
        public string Fields, Wall, Values;
        public double Width, Scale;
        public IList<string> Segments;
        public uint SegmentsFrame;
        public IList<string> SegmentNames;
        public string Image, Transform;
        public double WaitS;
        /// <summary>Further options as a JSON object; PalInfo.Options() lists all.</summary>
        public string Options;
    }

    public sealed class PalDeviceInfo
    {
        public string Name;
        public double MaxForceN, MaxStiffnessNPerM;
        public PalVector WorkspaceCentreM;
        public double WorkspaceRadiusM, ResolutionM, DelayS, ContinuousForceN, MaxTorqueNM;
    }

    /// <summary>A force device of the host, for a haptic thread of palpate's.</summary>
    public sealed class PalDevice
    {
        public PalDeviceInfo Info;
        public PalExchange Exchange;
        public PalGripRead Grip;
        public PalTorqueSend Torque;
    }

    public sealed class PalSessionInfo
    {
        public PalSessionFlags Flags;
        /// <summary>With HostTicks.</summary>
        public PalDeviceInfo Host;
        public PalDevice Device;
        public string DeviceName;
        public double MaxForceN, StiffnessNPerM, WatchdogS;
        public string Preset;
        public PalOnEvent OnEvent;
        public string Recording;
        public uint TubeButtons;
        public string Csv, BlackBox;
        public ulong ServePort;
        public string SimulatedPath, SimulatedHand;
        public double LetsGoS;
        public string Tool, Options;
    }

    public sealed class PalViewInfo
    {
        public PalViewFlags Flags;
        public uint Width, Height, EyeCount = 1;
        public string Look;
    }

    // ---- what functions give ----

    /// <summary>A motion in numbers; NaN where nothing was measured.</summary>
    public sealed class PalMotionSummary
    {
        public uint FrameCount, StepCount, IsWhole, ReferenceFrame, Harmonics;
        public double CycleS;
        public PalGrid Grid;
        public PalTrust Trust;
        public string TrustWord, Reasons;
        public double Seconds, MotionMeanMm, MotionMaxMm, FoldedVoxels, LeastDeterminant, CorrelationBefore, CorrelationAfter,
            MotionLeftVoxels, DriftMeanMm, Within95Mm;
    }

    /// <summary>A stream tube at the newest tick: points in m, world; Lengths in LengthUnit.</summary>
    public sealed class PalTube
    {
        public uint Volume, IsKept, IsClosed, SeedPoint;
        public PalTubeField Field;
        public PalVector[] PointsM;
        public double[] Lengths;
        public string LengthUnit;
    }

    /// <summary>The library itself.</summary>
    public static class PalInfo
    {
        /// <summary>The version of the header that this file was written for: major, minor and patch, as PAL_VERSION.</summary>
        public const uint HeaderVersion = 0 << 16 | 1 << 8 | 0;
        public static uint Version => Native.pal_version();
        public static string ResultName(PalResult result) => Text.Of(Native.pal_result_name(result));
        /// <summary>The table of options, a JSON list.</summary>
        public static string Options() => Text.Read((IntPtr text, UIntPtr capacity, out UIntPtr length) =>
            Native.pal_options(text, capacity, out length));
    }

    // ---- objects ----

    /// <summary>A handle of the library. It is closed by Dispose() or Close(), at the latest when it is collected.</summary>
    public abstract class PalHandle : SafeHandle
    {
        internal CallbackTarget target;
        PalException failure;

        internal PalHandle() : base(IntPtr.Zero, true) { }
        public override bool IsInvalid => handle == IntPtr.Zero;

        /// <summary>As Dispose(), but throws where closing fails: PalResult.BadOutput if a recording could not be written.</summary>
        public new void Close()
        {
            Dispose();
            if (failure != null) throw failure;
        }

        internal delegate PalResult Opener(out IntPtr handle);

        internal void Open(Opener opener)
        {
            try
            {
                Native.Check(opener(out var opened));
                SetHandle(opened);
            }
            catch
            {
                CallbackTarget.Remove(target);
                throw;
            }
        }

        internal abstract PalResult CloseHandle(ref IntPtr handle);

        protected override bool ReleaseHandle()
        {
            var closed = handle;
            var result = CloseHandle(ref closed);
            if (result < 0) failure = new PalException(result, Text.Of(Native.pal_last_error()));
            CallbackTarget.Remove(target);
            return result >= 0;
        }
    }

    /// <summary>The device that computes. [any thread]</summary>
    public sealed class PalContext : PalHandle
    {
        public PalContext(PalContextInfo info = null)
        {
            info = info ?? new PalContextInfo();
            using (var memory = new Memory())
            {
                var raw = new Native.PalContextInfo
                {
                    Size = Native.SizeOf<Native.PalContextInfo>(), Version = PalInfo.HeaderVersion, Flags = (uint)info.Flags,
                    Device = memory.Utf8(info.Device), MemoryCapBytes = info.MemoryCapBytes
                };
                if (info.Vulkan is PalVulkan host)
                    raw.Vulkan = memory.Structure(new Native.PalVulkan
                    {
                        Size = Native.SizeOf<Native.PalVulkan>(), QueueFamily = host.QueueFamily, Instance = host.Instance,
                        PhysicalDevice = host.PhysicalDevice, Device = host.Device, Queue = host.Queue,
                        HasExtendedFormats = host.HasExtendedFormats ? 1u : 0u, LockQueue = host.LockQueue,
                        UnlockQueue = host.UnlockQueue, User = host.User
                    });
                if (info.Log != null)
                {
                    target = CallbackTarget.Add(new CallbackTarget { Log = info.Log });
                    raw.Log = CallbackTarget.LogAddress;
                    raw.User = target.User;
                }
                Open((out IntPtr opened) => Native.pal_context_open(ref raw, out opened));
            }
        }

        /// <summary>The name of the device, "" if there is none.</summary>
        public string Device => Text.Of(Native.pal_context_device(this));
        internal override PalResult CloseHandle(ref IntPtr closed) => Native.pal_context_close(ref closed);
    }

    public sealed class PalSequenceInfo
    {
        /// <summary>A 4D file, a folder, 3D files in order, or DICOM folders with one frame each.</summary>
        public PalSequenceInfo(params string[] paths) { Paths = paths; }
        public IList<string> Paths;
        /// <summary>What samples become that are NaN; null: they are refused.</summary>
        public double? NanAs;
    }

    /// <summary>What the headers of a sequence's files say; Notes: a sentence per line.</summary>
    public sealed class PalSequenceSummary
    {
        public uint FrameCount;
        public bool HasTimes;
        public PalGrid Grid;
        public string Notes;
    }

    /// <summary>Frames from files, in any form that palpate reads. [any thread]</summary>
    public sealed class PalSequence : PalHandle
    {
        readonly long voxels;

        public PalSequence(PalSequenceInfo info)
        {
            using (var memory = new Memory())
            {
                var raw = new Native.PalSequenceInfo
                {
                    Size = Native.SizeOf<Native.PalSequenceInfo>(), Paths = memory.Utf8(info.Paths, out var count), PathCount = count,
                    NanAs = info.NanAs.HasValue ? memory.Structure(info.NanAs.Value) : IntPtr.Zero
                };
                Open((out IntPtr opened) => Native.pal_sequence_open(ref raw, out opened));
            }
            voxels = Summary().Grid.Size.Product;
        }

        public PalSequenceSummary Summary()
        {
            var raw = new Native.PalSequenceSummary { Size = Native.SizeOf<Native.PalSequenceSummary>() };
            Native.Check(Native.pal_sequence_summary(this, ref raw));
            return new PalSequenceSummary
            {
                FrameCount = raw.FrameCount, HasTimes = raw.HasTimes != 0, Grid = raw.Grid, Notes = Text.Of(raw.Notes)
            };
        }

        /// <summary>The samples of a frame, x fastest, and its time in s; without times its index. Null after the last.</summary>
        public float[] Frame(uint index, out double time_s)
        {
            var samples = new float[voxels];
            return Native.Check(Native.pal_sequence_frame(this, index, samples, out time_s)) == PalResult.End ? null : samples;
        }

        internal override PalResult CloseHandle(ref IntPtr closed) => Native.pal_sequence_close(ref closed);
    }

    /// <summary>Takes frames and estimates their motion. [any thread]</summary>
    public sealed class PalEstimator : PalHandle
    {
        readonly long voxels;

        public PalEstimator(PalContext context, PalEstimatorInfo info)
        {
            voxels = info.Grid.Size.Product;
            using (var memory = new Memory())
            {
                var raw = new Native.PalEstimatorInfo
                {
                    Size = Native.SizeOf<Native.PalEstimatorInfo>(), Flags = (uint)info.Flags, Grid = info.Grid,
                    Preset = memory.Utf8(info.Preset), Iterations = info.Iterations
                };
                if (info.Mask != null) raw.Mask = memory.Samples(info.Mask, voxels, "Mask", out _);
                if (info.OnProgress != null)
                {
                    target = CallbackTarget.Add(new CallbackTarget { OnProgress = info.OnProgress });
                    raw.OnProgress = CallbackTarget.ProgressAddress;
                    raw.User = target.User;
                }
                Open((out IntPtr opened) => Native.pal_estimator_open(context, ref raw, out opened));
                // Weak: what is kept for callbacks must not keep the estimator.
                if (target != null) target.Estimator = new WeakReference<PalEstimator>(this);
            }
        }

        /// <summary>Takes the next frame: an array of one of the types of PalSampleType, x fastest. time_s below 0: one second
        /// after the last frame.</summary>
        public void Push(Array samples, double time_s = -1.0)
        {
            using (var memory = new Memory())
                Push(memory.Samples(samples, voxels, "The frame", out var type), type, time_s);
        }

        /// <summary>The same with the address of all samples of the grid, such as that of a NativeArray.</summary>
        public void Push(IntPtr samples, PalSampleType type, double time_s = -1.0) =>
            Native.Check(Native.pal_estimator_push(this, type, samples, time_s));

        /// <summary>Does not wait.</summary>
        public PalProgress Poll()
        {
            var progress = new PalProgress { size = Native.SizeOf<PalProgress>() };
            Native.Check(Native.pal_estimator_poll(this, ref progress));
            return progress;
        }

        /// <summary>Waits for the motion and gives it, once.</summary>
        public PalMotion Finish()
        {
            try
            {
                return new PalMotion((out IntPtr motion) => Native.pal_estimator_finish(this, out motion));
            }
            catch (PalException failure) when (target?.Thrown != null)
            {
                throw new PalException(failure.Result, "The estimation was stopped: on_progress threw an exception: " +
                    target.Thrown.Message, target.Thrown);
            }
        }

        /// <summary>Also from OnProgress.</summary>
        public void Cancel() => Native.Check(Native.pal_estimator_cancel(this));
        internal override PalResult CloseHandle(ref IntPtr closed) => Native.pal_estimator_close(ref closed);
    }

    /// <summary>How the material moves between frames: displacement u in mm along L, P, S; x + u(x) is where the material at x of
    /// the fixed frame is in the moving one. [any thread]</summary>
    public sealed class PalMotion : PalHandle
    {
        /// <summary>Reads one motion for all frames from a file that Save() or the program wrote.</summary>
        public PalMotion(PalContext context, string path)
        {
            using (var memory = new Memory())
            {
                var file = memory.Utf8(path);
                Open((out IntPtr opened) => Native.pal_motion_open(context, file, out opened));
            }
        }
        internal PalMotion(Opener opener) { Open(opener); }

        public PalMotionSummary Summary()
        {
            var raw = new Native.PalMotionSummary { Size = Native.SizeOf<Native.PalMotionSummary>() };
            Native.Check(Native.pal_motion_summary(this, ref raw));
            return new PalMotionSummary
            {
                FrameCount = raw.FrameCount, StepCount = raw.StepCount, IsWhole = raw.IsWhole, ReferenceFrame = raw.ReferenceFrame,
                Harmonics = raw.Harmonics, CycleS = raw.CycleS, Grid = raw.Grid, Trust = raw.Trust,
                TrustWord = Text.Of(raw.TrustWord), Reasons = Text.Of(raw.Reasons), Seconds = raw.Seconds,
                MotionMeanMm = raw.MotionMeanMm, MotionMaxMm = raw.MotionMaxMm, FoldedVoxels = raw.FoldedVoxels,
                LeastDeterminant = raw.LeastDeterminant, CorrelationBefore = raw.CorrelationBefore,
                CorrelationAfter = raw.CorrelationAfter, MotionLeftVoxels = raw.MotionLeftVoxels, DriftMeanMm = raw.DriftMeanMm,
                Within95Mm = raw.Within95Mm
            };
        }

        /// <summary>u at the grid's samples: x, y, z of a sample side by side, mm.</summary>
        public float[] Field(PalFieldInfo info = null) =>
            Filled(info, 3, (ref Native.PalFieldInfo raw, float[] values) => Native.pal_motion_field(this, ref raw, values));

        /// <summary>The confidence of a field at each sample, 0 (a guess) to 1.</summary>
        public float[] Confidence(PalFieldInfo info = null) =>
            Filled(info, 1, (ref Native.PalFieldInfo raw, float[] values) => Native.pal_motion_confidence(this, ref raw, values));

        /// <summary>The standard deviation of a field's error at each sample, mm: along the image gradient and across it, side by
        /// side.</summary>
        public float[] Deviation(PalFieldInfo info = null) =>
            Filled(info, 2, (ref Native.PalFieldInfo raw, float[] values) => Native.pal_motion_deviation(this, ref raw, values));

        /// <summary>The frame's value at x + u(x) for each sample x of the grid. The frame is on the frames' grid, or, with an
        /// older file, on that of `info`.</summary>
        public float[] Warp(Array samples, PalFieldInfo info = null)
        {
            using (var memory = new Memory())
            {
                var frame = memory.Samples(samples, Summary().Grid.Size.Product, "The frame", out var type);
                return Filled(info, 1, (ref Native.PalFieldInfo raw, float[] values) =>
                    Native.pal_motion_warp(this, ref raw, type, frame, values));
            }
        }

        /// <summary>Writes a field, or with null the one motion for all frames (.nrrd).</summary>
        public void Save(PalFieldInfo info, string path)
        {
            using (var memory = new Memory())
            {
                var raw = info == null ? IntPtr.Zero : memory.Structure(Raw(info, memory));
                Native.Check(Native.pal_motion_save(this, raw, memory.Utf8(path)));
            }
        }

        delegate PalResult Filler(ref Native.PalFieldInfo raw, float[] values);

        float[] Filled(PalFieldInfo info, int components, Filler filler)
        {
            info = info ?? new PalFieldInfo();
            var values = new float[checked((info.Grid ?? Summary().Grid).Size.Product * components)];
            using (var memory = new Memory())
            {
                var raw = Raw(info, memory);
                Native.Check(filler(ref raw, values));
            }
            return values;
        }

        static Native.PalFieldInfo Raw(PalFieldInfo info, Memory memory) => new Native.PalFieldInfo
        {
            Size = Native.SizeOf<Native.PalFieldInfo>(), Flags = (uint)info.Flags, Step = info.Step, TimeS = info.TimeS,
            Grid = info.Grid.HasValue ? memory.Structure(info.Grid.Value) : IntPtr.Zero
        };

        internal override PalResult CloseHandle(ref IntPtr closed) => Native.pal_motion_close(ref closed);
    }

    /// <summary>What there is to feel and see. [any thread]</summary>
    public sealed class PalScene : PalHandle
    {
        /// <summary>The number of samples of the frames in memory; 0: there are none.</summary>
        internal readonly long FrameVoxels;
        internal readonly PalContext Context;

        /// <summary>Reads the data and prepares them, which takes between parts of a second and many seconds.</summary>
        public PalScene(PalContext context, PalSceneInfo info)
        {
            Context = context;
            using (var memory = new Memory())
            {
                var raw = new Native.PalSceneInfo
                {
                    Size = Native.SizeOf<Native.PalSceneInfo>(), Flags = (uint)info.Flags,
                    Paths = memory.Utf8(info.Paths, out var paths), PathCount = paths, Json = memory.Utf8(info.Json), Folder = memory.Utf8(info.Folder),
                    ModeLibraries = memory.Utf8(info.ModeLibraries, out var libraries), ModeLibraryCount = libraries,
                    IsoValue = info.IsoValue.HasValue ? memory.Structure(info.IsoValue.Value) : IntPtr.Zero,
                    StrengthN = info.StrengthN, Friction = info.Friction, FramesPerSecond = info.FramesPerSecond,
                    Fields = memory.Utf8(info.Fields), Wall = memory.Utf8(info.Wall), Values = memory.Utf8(info.Values),
                    Width = info.Width, Scale = info.Scale, Segments = memory.Utf8(info.Segments, out var files), SegmentationCount = files,
                    SegmentsFrame = info.SegmentsFrame, SegmentNames = memory.Utf8(info.SegmentNames, out var names),
                    SegmentCount = names, Image = memory.Utf8(info.Image), Transform = memory.Utf8(info.Transform),
                    WaitS = info.WaitS, Options = memory.Utf8(info.Options)
                };
                if (info.Frames != null && info.Frames.Count > 0)
                {
                    FrameVoxels = info.Frames[0].Grid.Size.Product;
                    raw.FrameSets = (uint)info.Frames.Count;
                    raw.Frames = memory.Structures(info.Frames, frames => Raw(frames, memory));
                }
                Open((out IntPtr opened) => Native.pal_scene_open(context, ref raw, out opened));
                // The call has read all that it needs of the motions.
                foreach (var frames in info.Frames ?? new PalFrames[0]) GC.KeepAlive(frames.Motion);
            }
        }

        static Native.PalFrames Raw(PalFrames frames, Memory memory)
        {
            var addresses = new IntPtr[frames.Frames.Count];
            var raw = new Native.PalFrames
            {
                Size = Native.SizeOf<Native.PalFrames>(), Name = memory.Utf8(frames.Name), Grid = frames.Grid,
                FrameCount = (uint)addresses.Length
            };
            for (var k = 0; k < addresses.Length; ++k)
            {
                addresses[k] = memory.Samples(frames.Frames[k], frames.Grid.Size.Product, "Frame " + k, out var type);
                if (k > 0 && type != raw.SampleType)
                    throw new PalException(PalResult.BadInput, "Frame " + k + " has another type than the first one");
                raw.SampleType = type;
            }
            raw.Frames = memory.Pinned(addresses);
            if (frames.TimesS != null)
            {
                if (frames.TimesS.Length != addresses.Length)
                    throw new PalException(PalResult.BadInput, frames.TimesS.Length + " times for " + addresses.Length + " frames");
                raw.TimesS = memory.Pinned(frames.TimesS);
            }
            raw.Motion = memory.Used(frames.Motion);
            return raw;
        }

        public string GetText(PalSceneText which) => Text.Read((IntPtr text, UIntPtr capacity, out UIntPtr length) =>
            Native.pal_scene_text(this, which, text, capacity, out length));

        /// <summary>False after the last volume.</summary>
        public bool GetVolume(uint index, out PalVolume volume)
        {
            volume = new PalVolume { size = Native.SizeOf<PalVolume>() };
            return Native.Check(Native.pal_scene_volume(this, index, ref volume)) == PalResult.Ok;
        }

        /// <summary>Replays a recording of this scene without a device, and compares every bit. tubes: a file for all stream tubes
        /// of the recording, or null.</summary>
        public PalReplay Replay(string recording, string tubes = null)
        {
            using (var memory = new Memory())
            {
                var replay = new PalReplay { size = Native.SizeOf<PalReplay>() };
                Native.Check(Native.pal_scene_replay(this, memory.Utf8(recording), memory.Utf8(tubes), ref replay));
                return replay;
            }
        }

        internal override PalResult CloseHandle(ref IntPtr closed) => Native.pal_scene_close(ref closed);
    }

    /// <summary>A scene that is felt.</summary>
    public sealed class PalSession : PalHandle
    {
        readonly PalScene scene;

        /// <summary>Starts the session. The force begins at zero and is ramped up over two seconds. [any thread]</summary>
        public PalSession(PalScene scene, PalSessionInfo info)
        {
            this.scene = scene;
            using (var memory = new Memory())
            {
                var raw = new Native.PalSessionInfo
                {
                    Size = Native.SizeOf<Native.PalSessionInfo>(), Flags = (uint)info.Flags, DeviceName = memory.Utf8(info.DeviceName),
                    MaxForceN = info.MaxForceN, StiffnessNPerM = info.StiffnessNPerM, WatchdogS = info.WatchdogS,
                    Preset = memory.Utf8(info.Preset), Recording = memory.Utf8(info.Recording), TubeButtons = info.TubeButtons,
                    Csv = memory.Utf8(info.Csv), BlackBox = memory.Utf8(info.BlackBox), ServePort = info.ServePort,
                    SimulatedPath = memory.Utf8(info.SimulatedPath), SimulatedHand = memory.Utf8(info.SimulatedHand),
                    LetsGoS = info.LetsGoS, Tool = memory.Utf8(info.Tool), Options = memory.Utf8(info.Options),
                    Host = Raw(info.Host, memory)
                };
                target = CallbackTarget.Add(new CallbackTarget
                {
                    OnEvent = info.OnEvent, Exchange = info.Device?.Exchange, GripRead = info.Device?.Grip,
                    TorqueSend = info.Device?.Torque,
                    Log = scene.Context?.target?.Log
                });
                if (info.OnEvent != null)
                {
                    raw.OnEvent = CallbackTarget.EventAddress;
                    raw.User = target.User;
                }
                if (info.Device != null)
                    raw.Device = memory.Structure(new Native.PalDevice
                    {
                        Size = Native.SizeOf<Native.PalDevice>(), Info = Raw(info.Device.Info, memory), User = target.User,
                        Exchange = info.Device.Exchange != null ? CallbackTarget.ExchangeAddress : IntPtr.Zero,
                        Grip = info.Device.Grip != null ? CallbackTarget.GripAddress : IntPtr.Zero,
                        Torque = info.Device.Torque != null ? CallbackTarget.TorqueAddress : IntPtr.Zero
                    });
                Open((out IntPtr opened) => Native.pal_session_open(scene, ref raw, out opened));
            }
        }

        static IntPtr Raw(PalDeviceInfo info, Memory memory) => info == null ? IntPtr.Zero : memory.Structure(new Native.PalDeviceInfo
        {
            Size = Native.SizeOf<Native.PalDeviceInfo>(), Name = memory.Utf8(info.Name), MaxForceN = info.MaxForceN,
            MaxStiffnessNPerM = info.MaxStiffnessNPerM, WorkspaceCentreM = info.WorkspaceCentreM,
            WorkspaceRadiusM = info.WorkspaceRadiusM, ResolutionM = info.ResolutionM, DelayS = info.DelayS,
            ContinuousForceN = info.ContinuousForceN,
            MaxTorqueNM = info.MaxTorqueNM
        });

        /// <summary>One haptic frame of a host that ticks (PalSessionFlags.HostTicks): the force on the hand, N, device space. Call it
        /// 250 to 4,000 times a second, on one thread at a time; a position that is not finite, or a time that does not rise,
        /// ramps the force to zero. No allocation, no lock.</summary>
        public PalVector Tick(PalTick tick)
        {
            var force_n = new PalVector();
            var result = Native.pal_haptics_tick(this, ref tick, ref force_n);
            if (result < 0) Native.Check(result);
            return force_n;
        }

        /// <summary>The torque that belongs to the force of the last tick, N m, about the grip's position, device space; zero unless the
        /// tool has several points. On the thread of the ticks. No allocation, no lock.</summary>
        public PalVector Torque()
        {
            var torque_n_m = new PalVector();
            var result = Native.pal_haptics_torque(this, ref torque_n_m);
            if (result < 0) Native.Check(result);
            return torque_n_m;
        }

        /// <summary>How the grip is held from the next tick on; on the thread of the ticks. No allocation, no lock.</summary>
        public void Hold(PalGrip grip)
        {
            grip.size = Native.SizeOf<PalGrip>();
            var result = Native.pal_haptics_hold(this, ref grip);
            if (result < 0) Native.Check(result);
        }

        /// <summary>Ramps the force to zero for good; waits for it where the haptic thread is palpate's. [any thread]</summary>
        public void Stop() => Native.Check(Native.pal_session_stop(this));
        /// <summary>The session was stopped, and the force has reached zero. [any thread]</summary>
        public bool IsAtRest => Native.pal_session_at_rest(this) == 1;

        /// <summary>The newest haptic frame; allocates nothing, but Cause and Word allocate each text once. [any thread]</summary>
        public void GetState(out PalState state)
        {
            state = new PalState { size = Native.SizeOf<PalState>() };
            Native.Check(Native.pal_session_state(this, ref state));
        }

        /// <summary>False after the last volume, and before the first haptic frame. [any thread]</summary>
        public bool GetVolume(uint index, out PalVolumeState volume)
        {
            volume = new PalVolumeState { size = Native.SizeOf<PalVolumeState>() };
            return Native.Check(Native.pal_session_volume(this, index, ref volume)) == PalResult.Ok;
        }

        /// <summary>Gives the next frame of a live scene; from one thread. grid null: that of the first frame. time_ns: of
        /// CLOCK_MONOTONIC, 0: now.</summary>
        public void PushFrame(Array samples, PalGrid? grid = null, long time_ns = 0)
        {
            using (var memory = new Memory())
            {
                var voxels = grid?.Size.Product ?? scene.FrameVoxels;
                var frame = memory.Samples(samples, voxels, "The frame", out var type);
                var on = grid.HasValue ? memory.Structure(grid.Value) : IntPtr.Zero;
                Native.Check(Native.pal_session_push_frame(this, on, type, frame, time_ns));
            }
        }

        /// <summary>False while the motion is not known. [any thread]</summary>
        public bool Play(bool on) => Native.Check(Native.pal_session_play(this, on ? 1 : 0)) == PalResult.Ok;
        /// <summary>Sets the time of every moving volume, 0 to 1, and pauses; false while the motion is not known. [any thread]</summary>
        public bool Scrub(double share) => Native.Check(Native.pal_session_scrub(this, share)) == PalResult.Ok;
        /// <summary>gain: 0 to 100. False: too many requests wait; call again. [any thread]</summary>
        public bool SetMode(uint index, bool on, double gain = 1.0) =>
            Native.Check(Native.pal_session_set_mode(this, index, on ? 1 : 0, gain)) == PalResult.Ok;
        /// <summary>Moves a movable volume (PalSceneFlags.Movable) on a smooth path. False: call again. [any thread]</summary>
        public bool Place(uint volume, PalPose world_from_volume) =>
            Native.Check(Native.pal_session_place(this, volume, ref world_from_volume)) == PalResult.Ok;
        /// <summary>Lets the force come back after an oscillation. False: call again. [any thread]</summary>
        public bool Rearm() => Native.Check(Native.pal_session_rearm(this)) == PalResult.Ok;
        /// <summary>Takes effect with the next tick. False: call again. [any thread]</summary>
        public bool AskTubes(PalTubesAction action) => Native.Check(Native.pal_session_ask_tubes(this, action)) == PalResult.Ok;

        /// <summary>A stream tube, the oldest first; null after the last one. [any thread]</summary>
        public PalTube GetTube(uint index)
        {
            var raw = new Native.PalTube { Size = Native.SizeOf<Native.PalTube>() };
            if (Native.Check(Native.pal_session_tube(this, index, ref raw)) != PalResult.Ok) return null;
            while (true)
                using (var memory = new Memory())
                {
                    // Another tube may have this index meanwhile: asked again until its points fit.
                    var points = new PalVector[raw.PointCount];
                    var lengths = new double[raw.PointCount];
                    raw.Capacity = raw.PointCount;
                    raw.PointsM = memory.Pinned(points);
                    raw.Lengths = memory.Pinned(lengths);
                    if (Native.Check(Native.pal_session_tube(this, index, ref raw)) != PalResult.Ok) return null;
                    if (raw.PointCount > raw.Capacity) continue;
                    Array.Resize(ref points, (int)raw.PointCount);
                    Array.Resize(ref lengths, (int)raw.PointCount);
                    return new PalTube
                    {
                        Volume = raw.Volume, IsKept = raw.IsKept, IsClosed = raw.IsClosed, Field = raw.Field,
                        SeedPoint = raw.SeedPoint, PointsM = points, Lengths = lengths, LengthUnit = Text.Of(raw.LengthUnit)
                    };
                }
        }

        /// <summary>Writes all tubes as lines (.vtk, mm, LPS). [any thread]</summary>
        public void SaveTubes(string path)
        {
            using (var memory = new Memory()) Native.Check(Native.pal_session_save_tubes(this, memory.Utf8(path)));
        }

        internal override PalResult CloseHandle(ref IntPtr closed) => Native.pal_session_close(ref closed);
    }

    /// <summary>Pictures of a session. One thread at a time.</summary>
    public sealed class PalView : PalHandle
    {
        uint width, height;

        /// <summary>Uploads the data, which takes time: not in the picture loop.</summary>
        public PalView(PalSession session, PalViewInfo info)
        {
            using (var memory = new Memory())
            {
                var raw = new Native.PalViewInfo
                {
                    Size = Native.SizeOf<Native.PalViewInfo>(), Flags = (uint)info.Flags, Width = info.Width, Height = info.Height,
                    EyeCount = info.EyeCount, Look = memory.Utf8(info.Look)
                };
                Open((out IntPtr opened) => Native.pal_view_open(session, ref raw, out opened));
            }
        }

        /// <summary>Submits a picture of the session as it will be ahead_s seconds from now, for Read(); does not wait. False before
        /// the first haptic frame.</summary>
        public bool Render(PalEye[] from, uint width, uint height, double ahead_s = 0.0)
        {
            var result = Native.Check(Native.pal_view_render(this, from, (uint)from.Length, width, height, ahead_s, IntPtr.Zero));
            if (result != PalResult.Ok) return false;
            this.width = width;
            this.height = height;
            return true;
        }

        /// <summary>The same into the host's images, in order with its own submissions to the shared queue.</summary>
        public bool Render(PalEye[] from, uint width, uint height, double ahead_s, PalImages images)
        {
            images.size = Native.SizeOf<PalImages>();
            return Native.Check(Native.pal_view_render(this, from, (uint)from.Length, width, height, ahead_s, ref images)) ==
                PalResult.Ok;
        }

        /// <summary>Waits for the last picture.</summary>
        public void Wait() => Native.Check(Native.pal_view_wait(this));

        /// <summary>The last picture of an eye: width * height pixels, rows from the top, R in the lowest byte; depth along the
        /// eye's axis in m, 0 where nothing is drawn. Either may be null.</summary>
        public void Read(uint eye, uint[] rgba, float[] depth_m)
        {
            var pixels = (long)width * height;
            if (rgba != null && rgba.Length < pixels || depth_m != null && depth_m.Length < pixels)
                throw new PalException(PalResult.BadInput, "The picture has " + pixels + " pixels, which do not fit");
            Native.Check(Native.pal_view_read(this, eye, rgba, depth_m));
        }

        internal override PalResult CloseHandle(ref IntPtr closed) => Native.pal_view_close(ref closed);
    }

    // ---- behind it ----

    /// <summary>For IL2CPP, which makes functions for C only of static methods with an attribute of this name.</summary>
    [AttributeUsage(AttributeTargets.Method)]
    sealed class MonoPInvokeCallbackAttribute : Attribute
    {
        public MonoPInvokeCallbackAttribute(Type type) { }
    }

    /// <summary>The delegates of one object. The library gets the address of a static method and, as `user`, the key of this in a
    /// table: both are valid for ever, and a key of a closed object calls nothing.</summary>
    sealed class CallbackTarget
    {
        internal PalLog Log;
        internal PalOnProgress OnProgress;
        internal PalOnEvent OnEvent;
        internal PalExchange Exchange;
        internal PalGripRead GripRead;
        internal PalTorqueSend TorqueSend;
        volatile bool torque_failed;
        internal WeakReference<PalEstimator> Estimator;
        internal volatile Exception Thrown;
        long key;
        ManualResetEvent failed;
        RegisteredWaitHandle waiting;
        string report;

        internal IntPtr User => new IntPtr(key);

        static readonly ConcurrentDictionary<long, CallbackTarget> targets = new ConcurrentDictionary<long, CallbackTarget>();
        static long last;

        internal static CallbackTarget Add(CallbackTarget target)
        {
            target.key = Interlocked.Increment(ref last);
            targets[target.key] = target;
            if (target.Exchange == null) return target;
            // Not on the haptic thread, nor on one that it starts, which would have its priority.
            target.failed = new ManualResetEvent(false);
            target.waiting = ThreadPool.RegisterWaitForSingleObject(target.failed,
                (state, timed_out) => target.Report(PalEventKind.Note, target.report), null, Timeout.Infinite, true);
            return target;
        }
        internal static void Remove(CallbackTarget target)
        {
            if (target == null) return;
            targets.TryRemove(target.key, out _);
            target.waiting?.Unregister(null);
        }
        static CallbackTarget Of(IntPtr user) => targets.TryGetValue(user.ToInt64(), out var target) ? target : null;

        static readonly Native.LogCallback log = CallLog;
        static readonly Native.ProgressCallback progress = CallProgress;
        static readonly Native.EventCallback happened = CallEvent;
        static readonly Native.ExchangeCallback exchange = CallExchange;
        static readonly Native.GripCallback grip_read = CallGrip;
        static readonly Native.TorqueCallback torque_send = CallTorque;
        internal static readonly IntPtr LogAddress = Marshal.GetFunctionPointerForDelegate(log);
        internal static readonly IntPtr ProgressAddress = Marshal.GetFunctionPointerForDelegate(progress);
        internal static readonly IntPtr EventAddress = Marshal.GetFunctionPointerForDelegate(happened);
        internal static readonly IntPtr ExchangeAddress = Marshal.GetFunctionPointerForDelegate(exchange);
        internal static readonly IntPtr GripAddress = Marshal.GetFunctionPointerForDelegate(grip_read);
        internal static readonly IntPtr TorqueAddress = Marshal.GetFunctionPointerForDelegate(torque_send);

        [MonoPInvokeCallback(typeof(Native.LogCallback))]
        static void CallLog(IntPtr user, IntPtr sentence)
        {
            try { Of(user)?.Log(Text.Of(sentence)); } catch { }
        }

        [MonoPInvokeCallback(typeof(Native.ProgressCallback))]
        static void CallProgress(IntPtr user, IntPtr doing, double share)
        {
            var target = Of(user);
            if (target == null) return;
            try
            {
                target.OnProgress(Text.Of(doing), share);
            }
            catch (Exception thrown)
            {
                if (target.Thrown == null) target.Thrown = thrown;
                try
                {
                    if (target.Estimator != null && target.Estimator.TryGetTarget(out var estimator)) estimator.Cancel();
                }
                catch { }  // it is being closed
            }
        }

        [MonoPInvokeCallback(typeof(Native.EventCallback))]
        static void CallEvent(IntPtr user, PalEventKind kind, IntPtr sentence) => Of(user)?.Report(kind, Text.Of(sentence));

        [MonoPInvokeCallback(typeof(Native.ExchangeCallback))]
        static void CallExchange(IntPtr user, ref PalVector force_n, ref PalReading reading)
        {
            var target = Of(user);
            try
            {
                target.Exchange(force_n, ref reading);
                // The exchange that follows a torque that was not sent counts as a fault, too.
                if (target.torque_failed) reading = new PalReading { Fault = PalFault.Garbage };
            }
            catch (Exception thrown)
            {
                // No reading can be trusted: the library ramps the force to zero.
                reading = new PalReading { Fault = PalFault.Garbage };
                target?.ReportOnce(thrown, "exchange");
            }
        }

        [MonoPInvokeCallback(typeof(Native.TorqueCallback))]
        static void CallTorque(IntPtr user, ref PalVector torque_n_m)
        {
            var target = Of(user);
            try
            {
                target.torque_failed = false;
                target.TorqueSend(torque_n_m);
            }
            catch (Exception thrown)
            {
                if (target == null) return;
                target.torque_failed = true;
                target.ReportOnce(thrown, "torque");
            }
        }

        [MonoPInvokeCallback(typeof(Native.GripCallback))]
        static void CallGrip(IntPtr user, ref PalGrip grip)
        {
            // An older library's structure may be shorter: nothing behind it may be written.
            var size = grip.size;
            if (size < Native.SizeOf<PalGrip>()) return;
            var target = Of(user);
            try
            {
                target.GripRead(ref grip);
            }
            catch (Exception thrown)
            {
                grip = new PalGrip();
                target?.ReportOnce(thrown, "grip");
            }
            grip.size = size;
        }

        void Report(PalEventKind kind, string sentence)
        {
            try
            {
                OnEvent?.Invoke(kind, sentence);
            }
            catch (Exception thrown)
            {
                try { Log?.Invoke("on_event threw an exception: " + thrown.Message); } catch { }
            }
        }

        /// <summary>On the haptic thread: another one reports it.</summary>
        void ReportOnce(Exception thrown, string callback)
        {
            if (Thrown != null) return;
            Thrown = thrown;
            report = callback + " threw an exception: " + thrown.Message;
            failed.Set();
        }
    }

    /// <summary>UTF-8 of C.</summary>
    static class Text
    {
        static readonly ConcurrentDictionary<long, string> fixed_texts = new ConcurrentDictionary<long, string>();

        internal static string Of(IntPtr text)
        {
            if (text == IntPtr.Zero) return "";
            var length = 0;
            while (Marshal.ReadByte(text, length) != 0) ++length;
            return Of(text, length);
        }

        static string Of(IntPtr text, int length)
        {
            var bytes = new byte[length];
            Marshal.Copy(text, bytes, 0, length);
            return Encoding.UTF8.GetString(bytes);
        }

        /// <summary>A text that the library never changes: converted once.</summary>
        internal static string Static(IntPtr text)
        {
            if (fixed_texts.TryGetValue(text.ToInt64(), out var found)) return found;
            return fixed_texts[text.ToInt64()] = Of(text);
        }

        internal delegate PalResult Writer(IntPtr text, UIntPtr capacity, out UIntPtr length);

        internal static string Read(Writer writer)
        {
            Native.Check(writer(IntPtr.Zero, UIntPtr.Zero, out var length));
            using (var memory = new Memory())
            {
                var text = memory.Block(checked((int)length.ToUInt64() + 1));
                Native.Check(writer(text, new UIntPtr(length.ToUInt64() + 1), out _));
                return Of(text, (int)length.ToUInt64());
            }
        }
    }

    /// <summary>What C reads during one call: copies, pinned arrays, and handles that must stay open.</summary>
    sealed class Memory : IDisposable
    {
        readonly List<IntPtr> blocks = new List<IntPtr>();
        readonly List<GCHandle> pins = new List<GCHandle>();
        readonly List<PalHandle> used = new List<PalHandle>();

        internal IntPtr Block(int bytes)
        {
            blocks.Add(Marshal.AllocHGlobal(bytes));
            return blocks[blocks.Count - 1];
        }

        internal IntPtr Utf8(string text)
        {
            if (text == null) return IntPtr.Zero;
            if (text.IndexOf('\0') >= 0) throw new PalException(PalResult.BadInput, "A text contains a zero character");
            var bytes = Encoding.UTF8.GetBytes(text + '\0');
            var block = Block(bytes.Length);
            Marshal.Copy(bytes, 0, block, bytes.Length);
            return block;
        }

        internal IntPtr Utf8(IList<string> texts, out uint count)
        {
            count = (uint)(texts?.Count ?? 0);
            if (count == 0) return IntPtr.Zero;
            var addresses = new IntPtr[count];
            for (var k = 0; k < addresses.Length; ++k) addresses[k] = Utf8(texts[k]);
            return Pinned(addresses);
        }

        internal IntPtr Structure<T>(T value) where T : struct
        {
            var block = Block(Marshal.SizeOf(typeof(T)));
            Marshal.StructureToPtr(value, block, false);
            return block;
        }

        internal IntPtr Structures<T, From>(IList<From> values, Func<From, T> make) where T : struct
        {
            var size = Marshal.SizeOf(typeof(T));
            var block = Block(size * values.Count);
            for (var k = 0; k < values.Count; ++k) Marshal.StructureToPtr(make(values[k]), IntPtr.Add(block, k * size), false);
            return block;
        }

        internal IntPtr Pinned(Array values)
        {
            pins.Add(GCHandle.Alloc(values, GCHandleType.Pinned));
            return pins[pins.Count - 1].AddrOfPinnedObject();
        }

        internal IntPtr Used(PalHandle handle)
        {
            if (handle == null) return IntPtr.Zero;
            var added = false;
            handle.DangerousAddRef(ref added);
            used.Add(handle);
            return handle.DangerousGetHandle();
        }

        /// <summary>The library reads as many samples as the grid has: an array of another size is refused.</summary>
        internal IntPtr Samples(Array samples, long count, string what, out PalSampleType type)
        {
            if (samples == null) throw new PalException(PalResult.BadInput, what + " is missing");
            switch (Type.GetTypeCode(samples.GetType().GetElementType()))
            {
                case TypeCode.Single: type = PalSampleType.Float32; break;
                case TypeCode.Double: type = PalSampleType.Float64; break;
                case TypeCode.SByte: type = PalSampleType.Int8; break;
                case TypeCode.Byte: type = PalSampleType.Uint8; break;
                case TypeCode.Int16: type = PalSampleType.Int16; break;
                case TypeCode.UInt16: type = PalSampleType.Uint16; break;
                case TypeCode.Int32: type = PalSampleType.Int32; break;
                case TypeCode.UInt32: type = PalSampleType.Uint32; break;
                default:
                    throw new PalException(PalResult.BadInput, what + " has elements of type " +
                        samples.GetType().GetElementType().Name + ", which is no type of samples");
            }
            if (samples.LongLength != count)
                throw new PalException(PalResult.BadInput,
                    what + " has " + samples.LongLength + " samples, its grid has " + count);
            return Pinned(samples);
        }

        public void Dispose()
        {
            foreach (var block in blocks) Marshal.FreeHGlobal(block);
            foreach (var pin in pins) pin.Free();
            foreach (var handle in used) handle.DangerousRelease();
        }
    }

    /// <summary>palpate.h itself: structures with pointers, and every function.</summary>
    static class Native
    {
        const string Library = "palpate";

        internal static uint SizeOf<T>() => Sizes<T>.Size;
        static class Sizes<T> { internal static readonly uint Size = (uint)Marshal.SizeOf(typeof(T)); }

        internal static PalResult Check(PalResult result)
        {
            if (result >= 0) return result;
            throw new PalException(result, Text.Of(pal_last_error()));
        }

        [UnmanagedFunctionPointer(CallingConvention.Cdecl)] internal delegate void LogCallback(IntPtr user, IntPtr sentence);
        [UnmanagedFunctionPointer(CallingConvention.Cdecl)]
        internal delegate void ProgressCallback(IntPtr user, IntPtr doing, double share);
        [UnmanagedFunctionPointer(CallingConvention.Cdecl)]
        internal delegate void EventCallback(IntPtr user, PalEventKind kind, IntPtr sentence);
        [UnmanagedFunctionPointer(CallingConvention.Cdecl)]
        internal delegate void ExchangeCallback(IntPtr user, ref PalVector force_n, ref PalReading reading);
        [UnmanagedFunctionPointer(CallingConvention.Cdecl)] internal delegate void GripCallback(IntPtr user, ref PalGrip grip);
        [UnmanagedFunctionPointer(CallingConvention.Cdecl)] internal delegate void TorqueCallback(IntPtr user, ref PalVector torque_n_m);

        [StructLayout(LayoutKind.Sequential)]
        internal struct PalVulkan
        {
            internal uint Size, QueueFamily;
            internal IntPtr Instance, PhysicalDevice, Device, Queue;
            internal uint HasExtendedFormats;
            internal IntPtr LockQueue, UnlockQueue, User;
        }

        [StructLayout(LayoutKind.Sequential)]
        internal struct PalContextInfo
        {
            internal uint Size, Version, Flags;
            internal IntPtr Device, Vulkan;
            internal ulong MemoryCapBytes;
            internal IntPtr Log, User;
        }

        [StructLayout(LayoutKind.Sequential)]
        internal struct PalSequenceInfo
        {
            internal uint Size;
            internal IntPtr Paths;
            internal uint PathCount;
            internal IntPtr NanAs;
        }

        [StructLayout(LayoutKind.Sequential)]
        internal struct PalSequenceSummary
        {
            internal uint Size, FrameCount, HasTimes;
            internal PalGrid Grid;
            internal IntPtr Notes;
        }

        [StructLayout(LayoutKind.Sequential)]
        internal struct PalEstimatorInfo
        {
            internal uint Size, Flags;
            internal PalGrid Grid;
            internal IntPtr Preset, Mask, OnProgress, User;
            internal uint Iterations;
        }

        [StructLayout(LayoutKind.Sequential)]
        internal struct PalMotionSummary
        {
            internal uint Size, FrameCount, StepCount, IsWhole, ReferenceFrame, Harmonics;
            internal double CycleS;
            internal PalGrid Grid;
            internal PalTrust Trust;
            internal IntPtr TrustWord, Reasons;
            internal double Seconds, MotionMeanMm, MotionMaxMm, FoldedVoxels, LeastDeterminant, CorrelationBefore, CorrelationAfter,
                MotionLeftVoxels, DriftMeanMm, Within95Mm;
        }

        [StructLayout(LayoutKind.Sequential)]
        internal struct PalFieldInfo
        {
            internal uint Size, Flags, Step;
            internal double TimeS;
            internal IntPtr Grid;
        }

        [StructLayout(LayoutKind.Sequential)]
        internal struct PalFrames
        {
            internal uint Size;
            internal IntPtr Name;
            internal PalGrid Grid;
            internal PalSampleType SampleType;
            internal IntPtr Frames;
            internal uint FrameCount;
            internal IntPtr TimesS, Motion;
        }

        [StructLayout(LayoutKind.Sequential)]
        internal struct PalSceneInfo
        {
            internal uint Size, Flags;
            internal IntPtr Paths;
            internal uint PathCount;
            internal IntPtr Json, Folder, Frames;
            internal uint FrameSets;
            internal IntPtr ModeLibraries;
            internal uint ModeLibraryCount;
            internal IntPtr IsoValue;
            internal double StrengthN, Friction, FramesPerSecond;
            internal IntPtr Fields, Wall, Values;
            internal double Width, Scale;
            internal IntPtr Segments;
            internal uint SegmentationCount, SegmentsFrame;
            internal IntPtr SegmentNames;
            internal ulong SegmentCount;
            internal IntPtr Image, Transform;
            internal double WaitS;
            internal IntPtr Options;
        }

        [StructLayout(LayoutKind.Sequential)]
        internal struct PalDeviceInfo
        {
            internal uint Size;
            internal IntPtr Name;
            internal double MaxForceN, MaxStiffnessNPerM;
            internal PalVector WorkspaceCentreM;
            internal double WorkspaceRadiusM, ResolutionM, DelayS, ContinuousForceN, MaxTorqueNM;
        }

        [StructLayout(LayoutKind.Sequential)]
        internal struct PalDevice
        {
            internal uint Size;
            internal IntPtr Info, Exchange, User, Grip, Torque;
        }

        [StructLayout(LayoutKind.Sequential)]
        internal struct PalSessionInfo
        {
            internal uint Size, Flags;
            internal IntPtr Host, Device, DeviceName;
            internal double MaxForceN, StiffnessNPerM, WatchdogS;
            internal IntPtr Preset, OnEvent, User, Recording;
            internal uint TubeButtons;
            internal IntPtr Csv, BlackBox;
            internal ulong ServePort;
            internal IntPtr SimulatedPath, SimulatedHand;
            internal double LetsGoS;
            internal IntPtr Tool, Options;
        }

        [StructLayout(LayoutKind.Sequential)]
        internal struct PalTube
        {
            internal uint Size, Volume, IsKept, IsClosed;
            internal PalTubeField Field;
            internal uint PointCount, SeedPoint, Capacity;
            internal IntPtr PointsM, Lengths, LengthUnit;
        }

        [StructLayout(LayoutKind.Sequential)]
        internal struct PalViewInfo
        {
            internal uint Size, Flags, Width, Height, EyeCount;
            internal IntPtr Look;
        }

        [DllImport(Library)] internal static extern uint pal_version();
        [DllImport(Library)] internal static extern IntPtr pal_result_name(PalResult result);
        [DllImport(Library)] internal static extern IntPtr pal_last_error();
        [DllImport(Library)] internal static extern PalResult pal_options(IntPtr text, UIntPtr capacity, out UIntPtr length);

        [DllImport(Library)] internal static extern PalResult pal_context_open(ref PalContextInfo info, out IntPtr context);
        [DllImport(Library)] internal static extern PalResult pal_context_close(ref IntPtr context);
        [DllImport(Library)] internal static extern IntPtr pal_context_device(PalContext context);

        [DllImport(Library)] internal static extern PalResult pal_sequence_open(ref PalSequenceInfo info, out IntPtr sequence);
        [DllImport(Library)] internal static extern PalResult pal_sequence_close(ref IntPtr sequence);
        [DllImport(Library)]
        internal static extern PalResult pal_sequence_summary(PalSequence sequence, ref PalSequenceSummary summary);
        [DllImport(Library)]
        internal static extern PalResult pal_sequence_frame(PalSequence sequence, uint index, [In, Out] float[] samples, out double time_s);

        [DllImport(Library)]
        internal static extern PalResult pal_estimator_open(PalContext context, ref PalEstimatorInfo info, out IntPtr estimator);
        [DllImport(Library)]
        internal static extern PalResult pal_estimator_push(PalEstimator estimator, PalSampleType type, IntPtr samples, double time_s);
        [DllImport(Library)] internal static extern PalResult pal_estimator_poll(PalEstimator estimator, ref PalProgress progress);
        [DllImport(Library)] internal static extern PalResult pal_estimator_finish(PalEstimator estimator, out IntPtr motion);
        [DllImport(Library)] internal static extern PalResult pal_estimator_cancel(PalEstimator estimator);
        [DllImport(Library)] internal static extern PalResult pal_estimator_close(ref IntPtr estimator);

        [DllImport(Library)] internal static extern PalResult pal_motion_open(PalContext context, IntPtr path, out IntPtr motion);
        [DllImport(Library)] internal static extern PalResult pal_motion_summary(PalMotion motion, ref PalMotionSummary summary);
        [DllImport(Library)]
        internal static extern PalResult pal_motion_field(PalMotion motion, ref PalFieldInfo info, [In, Out] float[] xyz_mm);
        [DllImport(Library)]
        internal static extern PalResult pal_motion_confidence(PalMotion motion, ref PalFieldInfo info, [In, Out] float[] values);
        [DllImport(Library)]
        internal static extern PalResult pal_motion_deviation(PalMotion motion, ref PalFieldInfo info, [In, Out] float[] alongAcrossMm);
        [DllImport(Library)]
        internal static extern PalResult pal_motion_warp(PalMotion motion, ref PalFieldInfo info, PalSampleType type, IntPtr samples,
            [In, Out] float[] warped);
        [DllImport(Library)] internal static extern PalResult pal_motion_save(PalMotion motion, IntPtr info, IntPtr path);
        [DllImport(Library)] internal static extern PalResult pal_motion_close(ref IntPtr motion);

        [DllImport(Library)]
        internal static extern PalResult pal_scene_open(PalContext context, ref PalSceneInfo info, out IntPtr scene);
        [DllImport(Library)]
        internal static extern PalResult pal_scene_text(PalScene scene, PalSceneText which, IntPtr text, UIntPtr capacity,
            out UIntPtr length);
        [DllImport(Library)] internal static extern PalResult pal_scene_volume(PalScene scene, uint index, ref PalVolume volume);
        [DllImport(Library)]
        internal static extern PalResult pal_scene_replay(PalScene scene, IntPtr recording, IntPtr tubes, ref PalReplay replay);
        [DllImport(Library)] internal static extern PalResult pal_scene_close(ref IntPtr scene);

        [DllImport(Library)]
        internal static extern PalResult pal_session_open(PalScene scene, ref PalSessionInfo info, out IntPtr session);
        [DllImport(Library)] internal static extern PalResult pal_session_close(ref IntPtr session);
        [DllImport(Library)] internal static extern PalResult pal_session_stop(PalSession session);
        [DllImport(Library)] internal static extern int pal_session_at_rest(PalSession session);
        [DllImport(Library)]
        internal static extern PalResult pal_haptics_tick(PalSession session, ref PalTick tick, ref PalVector force_n);
        [DllImport(Library)] internal static extern PalResult pal_haptics_hold(PalSession session, ref PalGrip grip);
        [DllImport(Library)] internal static extern PalResult pal_haptics_torque(PalSession session, ref PalVector torque_n_m);
        [DllImport(Library)] internal static extern PalResult pal_session_state(PalSession session, ref PalState state);
        [DllImport(Library)]
        internal static extern PalResult pal_session_volume(PalSession session, uint index, ref PalVolumeState volume);
        [DllImport(Library)]
        internal static extern PalResult pal_session_push_frame(PalSession session, IntPtr grid, PalSampleType type, IntPtr samples,
            long time_ns);
        [DllImport(Library)] internal static extern PalResult pal_session_play(PalSession session, int on);
        [DllImport(Library)] internal static extern PalResult pal_session_scrub(PalSession session, double share);
        [DllImport(Library)] internal static extern PalResult pal_session_set_mode(PalSession session, uint index, int on, double gain);
        [DllImport(Library)]
        internal static extern PalResult pal_session_place(PalSession session, uint volume, ref PalPose world_from_volume);
        [DllImport(Library)] internal static extern PalResult pal_session_rearm(PalSession session);
        [DllImport(Library)] internal static extern PalResult pal_session_ask_tubes(PalSession session, PalTubesAction action);
        [DllImport(Library)] internal static extern PalResult pal_session_tube(PalSession session, uint index, ref PalTube tube);
        [DllImport(Library)] internal static extern PalResult pal_session_save_tubes(PalSession session, IntPtr path);

        [DllImport(Library)]
        internal static extern PalResult pal_view_open(PalSession session, ref PalViewInfo info, out IntPtr view);
        [DllImport(Library)] internal static extern PalResult pal_view_close(ref IntPtr view);
        [DllImport(Library)]
        internal static extern PalResult pal_view_render(PalView view, PalEye[] eyes, uint eye_count, uint width, uint height,
            double ahead_s, IntPtr images);
        [DllImport(Library)]
        internal static extern PalResult pal_view_render(PalView view, PalEye[] eyes, uint eye_count, uint width, uint height,
            double ahead_s, ref PalImages images);
        [DllImport(Library)] internal static extern PalResult pal_view_wait(PalView view);
        [DllImport(Library)]
        internal static extern PalResult pal_view_read(PalView view, uint eye, [In, Out] uint[] rgba, [In, Out] float[] depth_m);
    }
}
