// The plugin for Unity's rendering, palpate_unity.h: Unity's Vulkan device for palpate, and palpate's pictures in Unity's
// cameras. It needs no class of Unity's.
using System;
using System.Runtime.InteropServices;
using System.Threading;

namespace Palpate
{
    /// <summary>What a script asks of the plugin. Main thread.</summary>
    public static class PalUnity
    {
        /// <summary>Unity's device, for PalContextInfo.Vulkan. A PalException says what to change where there is none.</summary>
        public static PalVulkan Device()
        {
            var raw = new Native.PalVulkan();
            var result = UnityNative.palpate_unity_device(ref raw);
            if (result < 0) throw new PalException(result, Text.Of(UnityNative.palpate_unity_error()));
            return new PalVulkan
            {
                QueueFamily = raw.QueueFamily, Instance = raw.Instance, PhysicalDevice = raw.PhysicalDevice, Device = raw.Device,
                Queue = raw.Queue, HasExtendedFormats = raw.HasExtendedFormats != 0, LockQueue = raw.LockQueue,
                UnlockQueue = raw.UnlockQueue, User = raw.User
            };
        }

        /// <summary>For CommandBuffer.IssuePluginEventAndData(Event, EventId, picture).</summary>
        public static IntPtr Event => UnityNative.palpate_unity_event();
        public static int EventId => UnityNative.palpate_unity_event_id();
    }

    /// <summary>One value for each of two eyes.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PalEyePointers { public IntPtr First, Second; }
    /// <summary>Of two eyes.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PalEyes { public PalEye First, Second; }

    /// <summary>What a camera shall show; see palpate_unity.h. Colour and Depth: RenderBuffer.GetNativeRenderBufferPtr() of a render
    /// texture per eye. Depths: 1/z in 1/m where the depth is 0 (Unity: 1 / far) and where it is 1 (1 / near).</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PalUnityPicture
    {
        internal uint size;
        public uint EyeCount;
        internal IntPtr view;
        public PalEyes Eyes;
        public double AheadS;
        public PalEyePointers Colour, Depth;
        public PalEyeLayers ColourLayer, DepthLayer;
        public double InverseDepth0, InverseDepth1;
        public uint WritesDepth;
        internal uint isDone;
        internal PalResult result;
        internal uint width, height;
        internal PalUnitySentence sentence;
        internal PalImages images;
    }

    /// <summary>248 bytes of text.</summary>
    [StructLayout(LayoutKind.Sequential, Size = 248)]
    struct PalUnitySentence { byte first; }

    /// <summary>Pictures for one camera. Unity draws a frame or two later than its scripts run, so there are a few slots. The view
    /// may be disposed of when IsIdle is true. Main thread.</summary>
    public sealed class PalUnityPictures : IDisposable
    {
        static readonly int done = (int)Marshal.OffsetOf(typeof(PalUnityPicture), "isDone");
        static readonly int result = (int)Marshal.OffsetOf(typeof(PalUnityPicture), "result");
        static readonly int sentence = (int)Marshal.OffsetOf(typeof(PalUnityPicture), "sentence");
        readonly IntPtr[] slots = new IntPtr[4];
        readonly bool[] issued = new bool[4];
        int next;

        public PalUnityPictures()
        {
            for (var k = 0; k < slots.Length; ++k) slots[k] = Marshal.AllocHGlobal(Marshal.SizeOf(typeof(PalUnityPicture)));
        }

        /// <summary>The address for IssuePluginEventAndData(); issue it once. IntPtr.Zero: the render thread is behind, draw
        /// nothing this time. Throws what an earlier picture failed with.</summary>
        public IntPtr Next(PalView view, PalUnityPicture picture)
        {
            if (issued[next] && !IsDone(next)) return IntPtr.Zero;
            var slot = slots[next];
            if (issued[next])
            {
                issued[next] = false;
                var failed = (PalResult)Marshal.ReadInt32(slot, result);
                if (failed < 0) throw new PalException(failed, Text.Of(IntPtr.Add(slot, sentence)));
            }
            picture.size = Native.SizeOf<PalUnityPicture>();
            picture.view = view.DangerousGetHandle();
            picture.isDone = 0;
            Marshal.StructureToPtr(picture, slot, false);
            issued[next] = true;
            next = (next + 1) % slots.Length;
            return slot;
        }

        /// <summary>No picture waits for the render thread.</summary>
        public bool IsIdle
        {
            get
            {
                for (var k = 0; k < slots.Length; ++k)
                    if (issued[k] && !IsDone(k)) return false;
                return true;
            }
        }

        bool IsDone(int slot)
        {
            var is_done = Marshal.ReadInt32(slots[slot], done) != 0;
            Thread.MemoryBarrier();
            return is_done;
        }

        /// <summary>Frees the slots; those that the render thread may still read are left to the process.</summary>
        public void Dispose()
        {
            for (var k = 0; k < slots.Length; ++k)
            {
                if (!issued[k] || IsDone(k)) Marshal.FreeHGlobal(slots[k]);
                slots[k] = IntPtr.Zero;
                issued[k] = false;
            }
        }
    }

    static class UnityNative
    {
        const string Library = "palpate_unity";
        [DllImport(Library)] internal static extern PalResult palpate_unity_device(ref Native.PalVulkan vulkan);
        [DllImport(Library)] internal static extern IntPtr palpate_unity_error();
        [DllImport(Library)] internal static extern IntPtr palpate_unity_event();
        [DllImport(Library)] internal static extern int palpate_unity_event_id();
    }
}
