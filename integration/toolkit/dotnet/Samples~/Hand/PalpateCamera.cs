// What PalpateHand feels, drawn into the pictures of a camera: put this on a camera that draws into a render texture with
// depth, one sample per pixel, ARGB32, with Vulkan as Unity's graphics API and its built-in render pipeline. Unity's objects
// and the volume hide each other.
using System;
using Palpate;
using UnityEngine;
using UnityEngine.Rendering;

[RequireComponent(typeof(Camera))]
public class PalpateCamera : MonoBehaviour
{
    [Tooltip("What it feels is drawn; its isDrawn must be on")]
    public PalpateHand hand;

    Camera seen;
    CommandBuffer commands;
    PalView view;
    PalSession shown;
    RenderTexture drawn;
    PalUnityPictures pictures;

    void Start()
    {
        seen = GetComponent<Camera>();
        pictures = new PalUnityPictures();
        commands = new CommandBuffer { name = "palpate" };
        seen.AddCommandBuffer(CameraEvent.AfterEverything, commands);
    }

    void OnPreRender()
    {
        commands.Clear();
        var image = seen.targetTexture;
        if (hand == null || hand.Session == null || image == null) return;
        try
        {
            if (shown != hand.Session || drawn != image)
            {
                // The render thread may still draw the view that is replaced.
                if (!pictures.IsIdle) return;
                view?.Dispose();
                view = new PalView(hand.Session, new PalViewInfo { Width = (uint)image.width, Height = (uint)image.height });
                shown = hand.Session;
                drawn = image;
            }
            var from = seen.transform;
            var tan_up = Math.Tan(seen.fieldOfView * Math.PI / 360);
            var tan_right = tan_up * image.width / image.height;
            var picture = new PalUnityPicture
            {
                EyeCount = 1, InverseDepth0 = 1.0 / seen.farClipPlane, InverseDepth1 = 1.0 / seen.nearClipPlane, WritesDepth = 1,
                Eyes = new PalEyes
                {
                    // Unity is left-handed: z and the axis of a rotation, as seen in a mirror, change their sign.
                    First = new PalEye
                    {
                        PositionM = new PalVector(from.position.x, from.position.y, -from.position.z),
                        Orientation = new PalQuaternion(-from.rotation.x, -from.rotation.y, from.rotation.z, from.rotation.w),
                        TanLeft = -tan_right, TanRight = tan_right, TanDown = -tan_up, TanUp = tan_up
                    }
                },
                Colour = new PalEyePointers { First = image.colorBuffer.GetNativeRenderBufferPtr() },
                Depth = new PalEyePointers { First = image.depthBuffer.GetNativeRenderBufferPtr() }
            };
            var slot = pictures.Next(view, picture);
            if (slot != IntPtr.Zero) commands.IssuePluginEventAndData(PalUnity.Event, PalUnity.EventId, slot);
        }
        catch (PalException failure)
        {
            Debug.LogError(failure.Message);
            enabled = false;
        }
    }

    void OnDestroy()
    {
        seen.RemoveCommandBuffer(CameraEvent.AfterEverything, commands);
        pictures.Dispose();
        view?.Dispose();
    }
}
