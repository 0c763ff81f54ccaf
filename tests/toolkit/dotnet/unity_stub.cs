// As much of Unity's scripting interface as the samples use, so that they compile and run in a test. Written for this test.
using System;
using System.Collections.Generic;

namespace UnityEngine
{
    public class Object
    {
        public static implicit operator bool(Object one) => one != null;
    }
    public class Component : Object
    {
        public readonly List<Component> Others = new List<Component>();
        public Transform transform = new Transform();
        public T GetComponent<T>() where T : Component
        {
            foreach (var other in Others)
                if (other is T found) return found;
            return null;
        }
    }
    public class MonoBehaviour : Component
    {
        public bool enabled = true;
    }
    public class Transform : Object
    {
        public Vector3 localPosition, position;
        public Quaternion rotation = new Quaternion { w = 1 };
    }
    public class Camera : Component
    {
        public RenderTexture targetTexture;
        public float fieldOfView = 60, nearClipPlane = 0.02F, farClipPlane = 5;
        public readonly List<Rendering.CommandBuffer> Buffers = new List<Rendering.CommandBuffer>();
        public void AddCommandBuffer(Rendering.CameraEvent when, Rendering.CommandBuffer commands) { Buffers.Add(commands); }
        public void RemoveCommandBuffer(Rendering.CameraEvent when, Rendering.CommandBuffer commands) { Buffers.Remove(commands); }
    }
    public class RenderTexture : Object
    {
        public int width, height;
        public RenderBuffer colorBuffer, depthBuffer;
    }
    public struct RenderBuffer
    {
        public IntPtr Native;
        public IntPtr GetNativeRenderBufferPtr() => Native;
    }
    public struct Quaternion { public float x, y, z, w; }
    [AttributeUsage(AttributeTargets.Class)]
    public sealed class RequireComponent : Attribute
    {
        public RequireComponent(Type type) { }
    }
    public struct Vector3
    {
        public float x, y, z;
        public Vector3(float x, float y, float z) { this.x = x; this.y = y; this.z = z; }
    }
    [AttributeUsage(AttributeTargets.Field)]
    public sealed class TooltipAttribute : Attribute
    {
        public TooltipAttribute(string text) { }
    }
    public static class Debug
    {
        public static readonly List<string> Said = new List<string>();
        public static void Log(object what) { Said.Add(what.ToString()); }
        public static void LogError(object what) { Said.Add("error: " + what); }
    }
}

namespace UnityEngine.Rendering
{
    public enum CameraEvent { AfterEverything }
    public class CommandBuffer
    {
        public string name;
        public readonly List<IntPtr> Data = new List<IntPtr>();
        public void Clear() { Data.Clear(); }
        public void IssuePluginEventAndData(IntPtr callback, int eventID, IntPtr data) { Data.Add(data); }
    }
}
