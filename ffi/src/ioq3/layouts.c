/*
 * The structures of the engine's renderer interface, declared in C from the field tables alone, so that a C compiler
 * says where everything lies. Prints "structure field offset size", and "structure - size 0" for each structure.
 */
#include <stddef.h>
#include <stdio.h>

typedef unsigned char byte;
typedef enum { qfalse, qtrue } qboolean;
typedef int qhandle_t;
typedef float vec3_t[3];
typedef enum { RT_FIRST, RT_LAST = 8 } refEntityType_t;
typedef enum { TC_FIRST } textureCompression_t;
typedef enum { GLDRV_FIRST } glDriverType_t;
typedef enum { GLHW_FIRST } glHardwareType_t;
typedef enum { STEREO_FIRST } stereoFrame_t;
typedef enum { FMV_FIRST } e_status;
typedef enum { h_first } ha_pref;

typedef struct {
	refEntityType_t reType;
	int renderfx;
	qhandle_t hModel;
	vec3_t lightingOrigin;
	float shadowPlane;
	vec3_t axis[3];
	qboolean nonNormalizedAxes;
	float origin[3];
	int frame;
	float oldorigin[3];
	int oldframe;
	float backlerp;
	int skinNum;
	qhandle_t customSkin;
	qhandle_t customShader;
	byte shaderRGBA[4];
	float shaderTexCoord[2];
	float shaderTime;
	float radius;
	float rotation;
} refEntity_t;

typedef struct {
	int x, y, width, height;
	float fov_x, fov_y;
	vec3_t vieworg;
	vec3_t viewaxis[3];
	int time;
	int rdflags;
	byte areamask[32];
	char text[8][32];
} refdef_t;

typedef struct {
	vec3_t xyz;
	float st[2];
	byte modulate[4];
} polyVert_t;

typedef struct {
	char renderer_string[1024];
	char vendor_string[1024];
	char version_string[1024];
	char extensions_string[8192];
	int maxTextureSize;
	int numTextureUnits;
	int colorBits, depthBits, stencilBits;
	glDriverType_t driverType;
	glHardwareType_t hardwareType;
	qboolean deviceSupportsGamma;
	textureCompression_t textureCompression;
	qboolean textureEnvAddAvailable;
	int vidWidth, vidHeight;
	float windowAspect;
	int displayFrequency;
	qboolean isFullscreen;
	qboolean stereoEnabled;
	qboolean smpActive;
} glconfig_t;

typedef struct {
	vec3_t origin;
	vec3_t axis[3];
} orientation_t;

typedef struct {
	int firstPoint;
	int numPoints;
} markFragment_t;

typedef struct {
	int height, top, bottom, pitch, xSkip, imageWidth, imageHeight;
	float s, t, s2, t2;
	qhandle_t glyph;
	char shaderName[32];
} glyphInfo_t;

typedef struct {
	glyphInfo_t glyphs[256];
	float glyphScale;
	char name[64];
} fontInfo_t;

typedef struct cvar_s cvar_t;
struct cvar_s {
	char *name, *string, *resetString, *latchedString;
	int flags;
	qboolean modified;
	int modificationCount;
	float value;
	int integer;
	qboolean validate;
	qboolean integral;
	float min, max;
	char *description;
	cvar_t *next, *prev, *hashNext, *hashPrev;
	int hashIndex;
};

typedef struct {
	void (*Printf)(int level, const char *format, ...);
	void (*Error)(int level, const char *format, ...);
	int (*Milliseconds)(void);
	void *(*Hunk_Alloc)(int size, ha_pref preference);
	void *(*Hunk_AllocateTempMemory)(int size);
	void (*Hunk_FreeTempMemory)(void *block);
	void *(*Malloc)(int bytes);
	void (*Free)(void *block);
	cvar_t *(*Cvar_Get)(const char *name, const char *value, int flags);
	void (*Cvar_Set)(const char *name, const char *value);
	void (*Cvar_SetValue)(const char *name, float value);
	void (*Cvar_CheckRange)(cvar_t *cvar, float min, float max, qboolean integral);
	void (*Cvar_SetDescription)(cvar_t *cvar, const char *text);
	int (*Cvar_VariableIntegerValue)(const char *name);
	void (*Cmd_AddCommand)(const char *name, void (*function)(void));
	void (*Cmd_RemoveCommand)(const char *name);
	int (*Cmd_Argc)(void);
	char *(*Cmd_Argv)(int index);
	void (*Cmd_ExecuteText)(int when, const char *text);
	byte *(*CM_ClusterPVS)(int cluster);
	void (*CM_DrawDebugSurface)(void (*draw)(int color, int count, float *points));
	int (*FS_FileIsInPAK)(const char *name, int *checksum);
	long (*FS_ReadFile)(const char *name, void **buffer);
	void (*FS_FreeFile)(void *buffer);
	char **(*FS_ListFiles)(const char *folder, const char *extension, int *count);
	void (*FS_FreeFileList)(char **list);
	void (*FS_WriteFile)(const char *path, const void *data, int size);
	qboolean (*FS_FileExists)(const char *file);
	void (*CIN_UploadCinematic)(int handle);
	int (*CIN_PlayCinematic)(const char *name, int x, int y, int w, int h, int bits);
	e_status (*CIN_RunCinematic)(int handle);
	void (*CL_WriteAVIVideoFrame)(const byte *data, int size);
	void (*IN_Init)(void *window);
	void (*IN_Shutdown)(void);
	void (*IN_Restart)(void);
	long (*ftol)(float value);
	void (*Sys_SetEnv)(const char *name, const char *value);
	void (*Sys_GLimpSafeInit)(void);
	void (*Sys_GLimpInit)(void);
	qboolean (*Sys_LowPhysicalMemory)(void);
} refimport_t;

typedef struct {
	void (*Shutdown)(qboolean destroy);
	void (*BeginRegistration)(glconfig_t *config);
	qhandle_t (*RegisterModel)(const char *name);
	qhandle_t (*RegisterSkin)(const char *name);
	qhandle_t (*RegisterShader)(const char *name);
	qhandle_t (*RegisterShaderNoMip)(const char *name);
	void (*LoadWorld)(const char *name);
	void (*SetWorldVisData)(const byte *vis);
	void (*EndRegistration)(void);
	void (*ClearScene)(void);
	void (*AddRefEntityToScene)(const refEntity_t *entity);
	void (*AddPolyToScene)(qhandle_t shader, int verts_each, const polyVert_t *verts, int count);
	int (*LightForPoint)(vec3_t point, vec3_t ambient, vec3_t directed, vec3_t direction);
	void (*AddLightToScene)(const vec3_t origin, float radius, float r, float g, float b);
	void (*AddAdditiveLightToScene)(const vec3_t origin, float radius, float r, float g, float b);
	void (*RenderScene)(const refdef_t *view);
	void (*SetColor)(const float *rgba);
	void (*DrawStretchPic)(float x, float y, float w, float h, float s1, float t1, float s2, float t2, qhandle_t shader);
	void (*DrawStretchRaw)(int x, int y, int w, int h, int cols, int rows, const byte *data, int client, qboolean dirty);
	void (*UploadCinematic)(int w, int h, int cols, int rows, const byte *data, int client, qboolean dirty);
	void (*BeginFrame)(stereoFrame_t frame);
	void (*EndFrame)(int *front, int *back);
	int (*MarkFragments)(int count, const vec3_t *points, const vec3_t projection, int room, vec3_t buffer, int fragments, markFragment_t *out);
	int (*LerpTag)(orientation_t *tag, qhandle_t model, int start, int end, float fraction, const char *name);
	void (*ModelBounds)(qhandle_t model, vec3_t mins, vec3_t maxs);
	void (*RegisterFont)(const char *name, int size, fontInfo_t *font);
	void (*RemapShader)(const char *from, const char *to, const char *offset);
	qboolean (*GetEntityToken)(char *buffer, int size);
	qboolean (*inPVS)(const vec3_t a, const vec3_t b);
	void (*TakeVideoFrame)(int a, int b, byte *capture, byte *encode, qboolean jpeg);
} refexport_t;

#define F(s, f) printf(#s " " #f " %zu %zu\n", offsetof(s, f), sizeof(((s *)0)->f));
#define S(s) printf(#s " - %zu 0\n", sizeof(s));

int main(void)
{
	S(refEntity_t)
	F(refEntity_t, reType)
	F(refEntity_t, renderfx)
	F(refEntity_t, hModel)
	F(refEntity_t, lightingOrigin)
	F(refEntity_t, shadowPlane)
	F(refEntity_t, axis)
	F(refEntity_t, nonNormalizedAxes)
	F(refEntity_t, origin)
	F(refEntity_t, frame)
	F(refEntity_t, oldorigin)
	F(refEntity_t, oldframe)
	F(refEntity_t, backlerp)
	F(refEntity_t, skinNum)
	F(refEntity_t, customSkin)
	F(refEntity_t, customShader)
	F(refEntity_t, shaderRGBA)
	F(refEntity_t, shaderTexCoord)
	F(refEntity_t, shaderTime)
	F(refEntity_t, radius)
	F(refEntity_t, rotation)
	S(refdef_t)
	F(refdef_t, x)
	F(refdef_t, y)
	F(refdef_t, width)
	F(refdef_t, height)
	F(refdef_t, fov_x)
	F(refdef_t, fov_y)
	F(refdef_t, vieworg)
	F(refdef_t, viewaxis)
	F(refdef_t, time)
	F(refdef_t, rdflags)
	F(refdef_t, areamask)
	F(refdef_t, text)
	S(polyVert_t)
	F(polyVert_t, xyz)
	F(polyVert_t, st)
	F(polyVert_t, modulate)
	S(glconfig_t)
	F(glconfig_t, renderer_string)
	F(glconfig_t, vendor_string)
	F(glconfig_t, version_string)
	F(glconfig_t, extensions_string)
	F(glconfig_t, maxTextureSize)
	F(glconfig_t, numTextureUnits)
	F(glconfig_t, colorBits)
	F(glconfig_t, depthBits)
	F(glconfig_t, stencilBits)
	F(glconfig_t, driverType)
	F(glconfig_t, hardwareType)
	F(glconfig_t, deviceSupportsGamma)
	F(glconfig_t, textureCompression)
	F(glconfig_t, textureEnvAddAvailable)
	F(glconfig_t, vidWidth)
	F(glconfig_t, vidHeight)
	F(glconfig_t, windowAspect)
	F(glconfig_t, displayFrequency)
	F(glconfig_t, isFullscreen)
	F(glconfig_t, stereoEnabled)
	F(glconfig_t, smpActive)
	S(orientation_t)
	F(orientation_t, origin)
	F(orientation_t, axis)
	S(markFragment_t)
	F(markFragment_t, firstPoint)
	F(markFragment_t, numPoints)
	S(glyphInfo_t)
	F(glyphInfo_t, height)
	F(glyphInfo_t, top)
	F(glyphInfo_t, bottom)
	F(glyphInfo_t, pitch)
	F(glyphInfo_t, xSkip)
	F(glyphInfo_t, imageWidth)
	F(glyphInfo_t, imageHeight)
	F(glyphInfo_t, s)
	F(glyphInfo_t, t)
	F(glyphInfo_t, s2)
	F(glyphInfo_t, t2)
	F(glyphInfo_t, glyph)
	F(glyphInfo_t, shaderName)
	S(fontInfo_t)
	F(fontInfo_t, glyphs)
	F(fontInfo_t, glyphScale)
	F(fontInfo_t, name)
	S(cvar_t)
	F(cvar_t, name)
	F(cvar_t, string)
	F(cvar_t, resetString)
	F(cvar_t, latchedString)
	F(cvar_t, flags)
	F(cvar_t, modified)
	F(cvar_t, modificationCount)
	F(cvar_t, value)
	F(cvar_t, integer)
	F(cvar_t, validate)
	F(cvar_t, integral)
	F(cvar_t, min)
	F(cvar_t, max)
	F(cvar_t, description)
	F(cvar_t, next)
	F(cvar_t, prev)
	F(cvar_t, hashNext)
	F(cvar_t, hashPrev)
	F(cvar_t, hashIndex)
	S(refimport_t)
	F(refimport_t, Printf)
	F(refimport_t, Error)
	F(refimport_t, Milliseconds)
	F(refimport_t, Hunk_Alloc)
	F(refimport_t, Hunk_AllocateTempMemory)
	F(refimport_t, Hunk_FreeTempMemory)
	F(refimport_t, Malloc)
	F(refimport_t, Free)
	F(refimport_t, Cvar_Get)
	F(refimport_t, Cvar_Set)
	F(refimport_t, Cvar_SetValue)
	F(refimport_t, Cvar_CheckRange)
	F(refimport_t, Cvar_SetDescription)
	F(refimport_t, Cvar_VariableIntegerValue)
	F(refimport_t, Cmd_AddCommand)
	F(refimport_t, Cmd_RemoveCommand)
	F(refimport_t, Cmd_Argc)
	F(refimport_t, Cmd_Argv)
	F(refimport_t, Cmd_ExecuteText)
	F(refimport_t, CM_ClusterPVS)
	F(refimport_t, CM_DrawDebugSurface)
	F(refimport_t, FS_FileIsInPAK)
	F(refimport_t, FS_ReadFile)
	F(refimport_t, FS_FreeFile)
	F(refimport_t, FS_ListFiles)
	F(refimport_t, FS_FreeFileList)
	F(refimport_t, FS_WriteFile)
	F(refimport_t, FS_FileExists)
	F(refimport_t, CIN_UploadCinematic)
	F(refimport_t, CIN_PlayCinematic)
	F(refimport_t, CIN_RunCinematic)
	F(refimport_t, CL_WriteAVIVideoFrame)
	F(refimport_t, IN_Init)
	F(refimport_t, IN_Shutdown)
	F(refimport_t, IN_Restart)
	F(refimport_t, ftol)
	F(refimport_t, Sys_SetEnv)
	F(refimport_t, Sys_GLimpSafeInit)
	F(refimport_t, Sys_GLimpInit)
	F(refimport_t, Sys_LowPhysicalMemory)
	S(refexport_t)
	F(refexport_t, Shutdown)
	F(refexport_t, BeginRegistration)
	F(refexport_t, RegisterModel)
	F(refexport_t, RegisterSkin)
	F(refexport_t, RegisterShader)
	F(refexport_t, RegisterShaderNoMip)
	F(refexport_t, LoadWorld)
	F(refexport_t, SetWorldVisData)
	F(refexport_t, EndRegistration)
	F(refexport_t, ClearScene)
	F(refexport_t, AddRefEntityToScene)
	F(refexport_t, AddPolyToScene)
	F(refexport_t, LightForPoint)
	F(refexport_t, AddLightToScene)
	F(refexport_t, AddAdditiveLightToScene)
	F(refexport_t, RenderScene)
	F(refexport_t, SetColor)
	F(refexport_t, DrawStretchPic)
	F(refexport_t, DrawStretchRaw)
	F(refexport_t, UploadCinematic)
	F(refexport_t, BeginFrame)
	F(refexport_t, EndFrame)
	F(refexport_t, MarkFragments)
	F(refexport_t, LerpTag)
	F(refexport_t, ModelBounds)
	F(refexport_t, RegisterFont)
	F(refexport_t, RemapShader)
	F(refexport_t, GetEntityToken)
	F(refexport_t, inPVS)
	F(refexport_t, TakeVideoFrame)
	return 0;
}
