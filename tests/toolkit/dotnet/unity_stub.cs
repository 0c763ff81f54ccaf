// As much of Unity's scripting interface as the samples use, so that they compile and run in a test. Written for this test.
using System;
using System.Collections.Generic;

namespace UnityEngine
{
    public class Object
    {
        public static implicit operator bool(Object one) => one != null;
    }
    public class Component : Object { }
    public class MonoBehaviour : Component { }
    public class Transform : Component
    {
        public Vector3 localPosition;
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
