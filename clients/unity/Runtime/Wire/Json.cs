using System;
using System.Collections.Generic;
using System.Globalization;
using System.Text;

namespace Retina
{
    /// <summary>
    /// JSON as far as a stream's texts need it. Objects are Dictionary&lt;string, object&gt;, lists List&lt;object&gt;, numbers double; Unity's own JsonUtility
    /// reads no lists of lists, which triangles are.
    /// </summary>
    public static class Json
    {
        /// <summary>The value in a text.</summary>
        /// <exception cref="FormatException">The text is not JSON.</exception>
        public static object Read(string text)
        {
            var at = 0;
            var value = Value(text, ref at);
            Space(text, ref at);
            if (at != text.Length)
            {
                throw Wrong(text, at);
            }
            return value;
        }

        /// <summary>A text in quotes.</summary>
        public static string Quote(string text)
        {
            var quoted = new StringBuilder("\"");
            foreach (var character in text)
            {
                if (character == '"' || character == '\\')
                {
                    quoted.Append('\\').Append(character);
                }
                else if (character < ' ')
                {
                    quoted.Append("\\u").Append(((int)character).ToString("x4"));
                }
                else
                {
                    quoted.Append(character);
                }
            }
            return quoted.Append('"').ToString();
        }

        static FormatException Wrong(string text, int at)
        {
            return new FormatException("no JSON at character " + at + " of " + text.Length);
        }

        static void Space(string text, ref int at)
        {
            while (at < text.Length && " \t\r\n".IndexOf(text[at]) >= 0)
            {
                at++;
            }
        }

        static bool Take(string text, ref int at, char wanted)
        {
            Space(text, ref at);
            if (at >= text.Length || text[at] != wanted)
            {
                return false;
            }
            at++;
            return true;
        }

        static void Expect(string text, ref int at, char wanted)
        {
            if (!Take(text, ref at, wanted))
            {
                throw Wrong(text, at);
            }
        }

        static object Value(string text, ref int at)
        {
            Space(text, ref at);
            if (at >= text.Length)
            {
                throw Wrong(text, at);
            }
            switch (text[at])
            {
                case '{': return Fields(text, ref at);
                case '[': return Items(text, ref at);
                case '"': return Text(text, ref at);
                case 't': return Word(text, ref at, "true", true);
                case 'f': return Word(text, ref at, "false", false);
                case 'n': return Word(text, ref at, "null", null);
                default: return Number(text, ref at);
            }
        }

        static object Word(string text, ref int at, string word, object value)
        {
            if (string.CompareOrdinal(text, at, word, 0, word.Length) != 0)
            {
                throw Wrong(text, at);
            }
            at += word.Length;
            return value;
        }

        static Dictionary<string, object> Fields(string text, ref int at)
        {
            var fields = new Dictionary<string, object>();
            Expect(text, ref at, '{');
            if (Take(text, ref at, '}'))
            {
                return fields;
            }
            do
            {
                Space(text, ref at);
                var name = Text(text, ref at);
                Expect(text, ref at, ':');
                fields[name] = Value(text, ref at);
            }
            while (Take(text, ref at, ','));
            Expect(text, ref at, '}');
            return fields;
        }

        static List<object> Items(string text, ref int at)
        {
            var items = new List<object>();
            Expect(text, ref at, '[');
            if (Take(text, ref at, ']'))
            {
                return items;
            }
            do
            {
                items.Add(Value(text, ref at));
            }
            while (Take(text, ref at, ','));
            Expect(text, ref at, ']');
            return items;
        }

        static string Text(string text, ref int at)
        {
            Expect(text, ref at, '"');
            var read = new StringBuilder();
            while (at < text.Length && text[at] != '"')
            {
                var character = text[at++];
                if (character != '\\')
                {
                    read.Append(character);
                    continue;
                }
                if (at >= text.Length)
                {
                    break;
                }
                var escaped = text[at++];
                var simple = "\"\\/bfnrt".IndexOf(escaped);
                if (simple >= 0)
                {
                    read.Append("\"\\/\b\f\n\r\t"[simple]);
                }
                else if (escaped == 'u' && at + 4 <= text.Length)
                {
                    read.Append((char)int.Parse(text.Substring(at, 4), NumberStyles.HexNumber, CultureInfo.InvariantCulture));
                    at += 4;
                }
                else
                {
                    throw Wrong(text, at);
                }
            }
            Expect(text, ref at, '"');
            return read.ToString();
        }

        static object Number(string text, ref int at)
        {
            var begin = at;
            while (at < text.Length && "+-.eE0123456789".IndexOf(text[at]) >= 0)
            {
                at++;
            }
            double number;
            if (!double.TryParse(text.Substring(begin, at - begin), NumberStyles.Float, CultureInfo.InvariantCulture, out number))
            {
                throw Wrong(text, begin);
            }
            return number;
        }
    }
}
