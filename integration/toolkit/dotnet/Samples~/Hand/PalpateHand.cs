// A hand in a moving volume: put this on an object, name a scene, press play. Forces are computed in palpate's own haptic
// thread and by its own device drivers: a frame of Unity, or a garbage collection, does not delay them.
using System.Collections.Concurrent;
using Palpate;
using UnityEngine;

public class PalpateHand : MonoBehaviour
{
    [Tooltip("A scene file, a folder of frames, \"heart\" or \"shell\"")]
    public string scene = "heart";
    [Tooltip("As palpate's option --device, such as falcon; empty: the first that answers")]
    public string device = "simulated";
    [Tooltip("The largest force, N; 0: the scene's")]
    public double maxForceN;
    [Tooltip("Moved to where the hand is, and to where it touches")]
    public Transform hand, proxy;
    [Tooltip("The motion that is missing is estimated on the GPU")]
    public bool estimates;
    [Tooltip("A PalpateCamera draws it: on Unity's own Vulkan device")]
    public bool isDrawn;

    /// <summary>True while something is felt.</summary>
    public bool InContact { get; private set; }
    /// <summary>Why the force is not the scene's, a sentence, or "".</summary>
    public string Cause { get; private set; } = "";
    /// <summary>On the hand, N, along Unity's axes.</summary>
    public Vector3 ForceN { get; private set; }
    /// <summary>The running session, for everything else; null if it could not be opened.</summary>
    public PalSession Session { get; private set; }

    readonly ConcurrentQueue<string> told = new ConcurrentQueue<string>();
    PalContext context;
    PalScene opened;

    void OnEnable()
    {
        try
        {
            context = new PalContext(new PalContextInfo
            {
                Flags = estimates || isDrawn ? PalContextFlags.None : PalContextFlags.NoGpu,
                Vulkan = isDrawn ? PalUnity.Device() : null
            });
            opened = new PalScene(context, new PalSceneInfo(scene));
            // Events come on other threads: Update() logs them. The queue, not this object, is kept for them.
            var queue = told;
            Session = new PalSession(opened, new PalSessionInfo
            {
                DeviceName = device == "" ? null : device, MaxForceN = maxForceN,
                Flags = estimates ? PalSessionFlags.None : PalSessionFlags.NoEstimation,
                OnEvent = (kind, sentence) => queue.Enqueue(sentence)
            });
            Session.Play(true);
        }
        catch (PalException failure)
        {
            Debug.LogError(failure.Message);
            OnDisable();
        }
    }

    void Update()
    {
        while (told.TryDequeue(out var sentence)) Debug.Log(sentence);
        if (Session == null) return;
        Session.GetState(out var state);
        InContact = state.InContact != 0;
        Cause = state.CauseSentence;
        ForceN = Of(state.ForceN);
        if (hand) hand.localPosition = Of(state.HandM);
        if (proxy) proxy.localPosition = Of(state.ProxyM);
    }

    /// <summary>Ends the force by a ramp, at most 0.6 s.</summary>
    void OnDisable()
    {
        Session?.Dispose();
        opened?.Dispose();
        context?.Dispose();
        Session = null;
        opened = null;
        context = null;
    }

    /// <summary>palpate's world is right-handed, Unity's left-handed: z changes its sign. m and N stay.</summary>
    static Vector3 Of(PalVector v) => new Vector3((float)v.X, (float)v.Y, -(float)v.Z);
}
